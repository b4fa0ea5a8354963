"""``python -m pamsim`` and the console script: the command line, in a process of its own."""

import signal
import sys


def program() -> None:
    """As `pamsim.cli.main.main`, also interrupted in one line while that is imported.

    Nothing interrupts the interpreter in its own end.
    """
    try:
        from pamsim.cli.main import main

        main()
    except KeyboardInterrupt:
        print("pamsim: interrupted", file=sys.stderr)
        sys.exit(130)
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)


if __name__ == "__main__":
    program()
