"""Whoever waits for a compilation is given a reason, and nobody else is."""

from __future__ import annotations

import time

import pytest

from pamsim.core import compile_notice


@pytest.fixture(autouse=True)
def soon(monkeypatch):
    monkeypatch.setattr(compile_notice, "_AFTER", 0.05)


@pytest.mark.parametrize(
    ("terminal", "seconds", "printed"),
    [
        (True, 0.4, "pamsim: compiling the laws, once for this installation (a minute)\n"),
        (True, 0.0, ""),
        (False, 0.4, ""),
    ],
)
def test_one_line_on_a_terminal_while_it_takes_long(
    terminal, seconds, printed, capsys, monkeypatch
):
    monkeypatch.setattr("sys.stderr.isatty", lambda: terminal)
    with compile_notice.compile_notice("the laws", "a minute"):
        time.sleep(seconds)
    time.sleep(0.1)
    assert capsys.readouterr() == ("", printed)
