"""``python -m pamsim``: the command line."""

from pamsim.cli.main import main

if __name__ == "__main__":
    main()
