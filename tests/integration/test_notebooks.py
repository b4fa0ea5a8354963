"""The notebooks' scripts run, with the small settings that they state."""

from __future__ import annotations

import re
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

NOTEBOOKS = sorted((Path(__file__).parents[2] / "docs" / "notebooks").glob("*.py"))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(path, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    plt.switch_backend("agg")
    text = path.read_text(encoding="utf-8")
    small, count = re.subn(r"= .+  # in a test: (.+)", r"= \1", text)
    assert count
    exec(compile(small, path.name, "exec"), {"__name__": "__main__"})
    assert plt.get_fignums()
    plt.close("all")
    printed = capsys.readouterr()
    assert printed.out.count("\n") > 2
    assert "Warning" not in printed.err


def test_there_are_four():
    assert len(NOTEBOOKS) == 4
