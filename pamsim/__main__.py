"""``python -m pamsim`` and the console script: the command line, in a process of its own."""

import atexit
import contextlib
import os
import signal
import sys
from typing import NoReturn

_INTERRUPTED = 130  # as in pamsim.cli.main, whose import may be what is interrupted
_SIGNALS = (signal.SIGINT, signal.SIGTERM)


def program() -> None:
    """As `pamsim.cli.main.main`, also interrupted in one line while that is imported.

    Nothing interrupts the interpreter in its own end.
    """
    interrupted = False

    def end(*_: object) -> None:
        nonlocal interrupted
        interrupted = True
        raise KeyboardInterrupt

    for number in _SIGNALS:
        signal.signal(number, end)
    try:
        from pamsim.cli.main import main

        main()
    except SystemExit as ended:
        if ended.code == _INTERRUPTED:
            _leave()
        raise
    except BaseException:
        if not interrupted:
            raise
        print("pamsim: interrupted", file=sys.stderr)
        _leave()
    finally:
        _undisturbed()


def _undisturbed() -> None:
    for number in _SIGNALS:
        signal.signal(number, signal.SIG_IGN)


def _leave() -> NoReturn:
    """End as interrupted, and finalise nothing.

    An import may have been interrupted: Python would print what its half-made objects raise as they
    are deleted, abort where a thread still prints, or report the signal instead of the code.
    """
    _undisturbed()
    atexit._run_exitfuncs()  # pyright: ignore[reportPrivateUsage, reportAttributeAccessIssue]
    with contextlib.suppress(OSError):  # nobody reads
        sys.stdout.flush()
        sys.stderr.flush()
    os._exit(_INTERRUPTED)


if __name__ == "__main__":
    program()
