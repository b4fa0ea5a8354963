"""``pamsim`` as a user types it."""

import pytest

from pamsim.cli.main import main


def run(monkeypatch, capsys, *words):
    """Run ``pamsim WORDS`` through its entry point; returns exit code, output and errors."""
    monkeypatch.setattr("sys.argv", ["pamsim", *map(str, words)])
    with pytest.raises(SystemExit) as ended:
        main()
    captured = capsys.readouterr()
    return ended.value.code, captured.out, captured.err
