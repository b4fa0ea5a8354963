"""Blocks of the pages of documentation, and their commands run in this process.

A process for every line takes twice as long as all of them.
"""

import re
import shlex
from pathlib import Path

import pytest

from pamsim.cli.main import main

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.MULTILINE | re.DOTALL)


def run_line(line, monkeypatch):
    """Run a line of a shell that begins with ``pamsim``; a ``*`` stands for the files there."""
    words = [
        sorted(map(str, Path().glob(w))) or [w] if "*" in w else [w] for w in shlex.split(line)
    ]
    monkeypatch.setattr("sys.argv", [word for part in words for word in part])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 0, line
