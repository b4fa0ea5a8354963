"""The page about sweeps, block by block in one folder, as a reader runs it."""

from __future__ import annotations

import json
import re
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.recordings.array_files import read_arrays
from tests.typed_command import run
from tests.unit.report.page_laws import check_page

PAGE = Path(__file__).parents[3] / "docs" / "sweep.md"
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.M | re.S)


@pytest.fixture
def typed(tmp_path, monkeypatch, capsys):
    """Runs a command in a folder that holds the study; returns code, output and errors."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "study.toml").write_text(dict(BLOCKS)["toml"], encoding="utf-8")
    return lambda *words: run(monkeypatch, capsys, *words)


def run_block(text, every="", some=""):
    """Run a block of Python, with some of its values in place of all; returns its names."""
    assert every in text
    names: dict[str, object] = {"__name__": "__main__"}
    exec(compile(text.replace(every, some), "snippet", "exec"), names)
    return names


def test_the_page_runs(tmp_path, typed, capsys):
    assert [kind for kind, _ in BLOCKS] == ["toml", "sh", "python", "python", "python"]
    words = dict(BLOCKS)["sh"].split()[1:]
    code, shown, _ = typed(*words)
    assert (code, "32 runs, 0 of them failed" in shown) == (0, True)
    result = json.loads((tmp_path / "out" / "sweep.json").read_text(encoding="utf-8"))
    assert result["rank_correlations"]["final_deg"]["coulomb_friction"] < 0.0
    assert (tmp_path / "out" / "sweep.png").stat().st_size > 10_000
    page = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert "<b>32</b> 0 of them failed" in page
    check_page(page)
    assert typed(*words, "--resume")[0] == 0  # nothing is left to do
    simulated, calibrated, own = (text for kind, text in BLOCKS if kind == "python")
    run_block(simulated)
    assert "6 runs, 0 of them failed" in capsys.readouterr().out
    found = run_block(calibrated, '"values": [1, 3]', '"values": [1]')["found"]
    planted = found["true.joint.shaft.damping"]
    np.testing.assert_allclose(found["found.joint.shaft.damping"], planted, rtol=0.1)
    run_block(own, "(0.0, 1.2)", "(0.0,)")
    low, high = read_arrays(tmp_path / "tracking" / "runs.parquet")["rmse"]
    assert 0.0 < low < high  # of the PID with the smaller gain, and the larger


def test_executors_that_cannot_be_had_are_one_line_and_one_process_is_enough(typed, monkeypatch):
    def without_certificates(address, **_):
        raise TypeError("TLS expects a `ssl_context` argument")

    def called(*_, executor, **__):
        raise InputError("it was called" if isinstance(executor, ProcessPoolExecutor) else "")

    monkeypatch.setattr("pamsim.sweeps.sweep.sweep", called)
    dask = SimpleNamespace(distributed=SimpleNamespace(Client=without_certificates))
    monkeypatch.setitem(sys.modules, "dask", dask)
    monkeypatch.setitem(sys.modules, "dask.distributed", dask.distributed)
    scheduler = ["--scheduler", "tls://127.0.0.1:1"]
    for words, message in (
        (["--processes", "2", *scheduler], "not both"),
        (["--processes", "0"], "--processes is 0"),
        (["--processes", "1"], "it was called"),
        (scheduler, "--scheduler: no Dask scheduler at tls://127.0.0.1:1: TLS expects"),
    ):
        code, _, error = typed("sweep", "study.toml", "--out", "out", *words)
        assert (code, message in error, error.count("\n")) == (2, True, 1), error
