"""The page about sweeps, block by block in one folder, as a reader runs it."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from pamsim.recordings.array_files import read_arrays
from tests.typed_command import run
from tests.unit.report.page_laws import check_page

PAGE = Path(__file__).parents[3] / "docs" / "sweep.md"
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.M | re.S)


def test_the_page_runs(tmp_path, monkeypatch, capsys):
    assert [kind for kind, _ in BLOCKS] == ["toml", "sh", "python", "python", "python"]
    monkeypatch.chdir(tmp_path)
    texts = dict(BLOCKS)
    (tmp_path / "study.toml").write_text(texts["toml"], encoding="utf-8")
    words = texts["sh"].split()[1:]
    code, shown, _ = run(monkeypatch, capsys, *words)
    assert (code, "32 runs, 0 of them failed" in shown) == (0, True)
    result = json.loads((tmp_path / "out" / "sweep.json").read_text(encoding="utf-8"))
    assert result["rank_correlations"]["final_deg"]["coulomb_friction"] < 0.0
    assert (tmp_path / "out" / "sweep.png").stat().st_size > 10_000
    page = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert "<b>32</b> 0 of them failed" in page
    check_page(page)
    simulated, calibrated, own = (text for kind, text in BLOCKS if kind == "python")
    exec(compile(simulated, "snippet", "exec"), {"__name__": "__main__"})
    assert "6 runs, 0 of them failed" in capsys.readouterr().out
    names: dict[str, object] = {"__name__": "__main__"}
    exec(compile(calibrated, "snippet", "exec"), names)
    found = names["found"]
    np.testing.assert_allclose(
        found["found.joint.shaft.damping"], found["true.joint.shaft.damping"], rtol=0.1
    )
    exec(compile(own, "snippet", "exec"), {"__name__": "__main__"})
    low, high, *loaded = read_arrays(tmp_path / "tracking" / "runs.parquet")["rmse"]
    assert 0.0 < low < high  # of the PID with the smaller gain, and the larger
    assert loaded == pytest.approx([low, high], rel=0.1)
    assert run(monkeypatch, capsys, *words, "--resume")[0] == 0  # nothing is left to do


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--processes", "2", "--scheduler", "tcp://127.0.0.1:1"], "not both"),
        (["--processes", "0"], "--processes is 0"),
        (["--scheduler", "tcp://127.0.0.1:1"], "--scheduler"),
    ],
)
def test_executors_that_cannot_be_had_are_one_line(tmp_path, monkeypatch, capsys, words, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "study.toml").write_text(dict(BLOCKS)["toml"], encoding="utf-8")
    code, _, error = run(monkeypatch, capsys, "sweep", "study.toml", "--out", "out", *words)
    assert (code, message in error, error.count("\n")) == (2, True, 1), error
