"""A sweep's table holds what single simulations give, however it was computed."""

from __future__ import annotations

import pickle
import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from pyarrow import parquet

import pamsim
from pamsim.core.errors import EngineError, InputError
from pamsim.engine import batch
from pamsim.engine.batch import simulate_batch
from pamsim.recordings.step_metrics import step_figures
from pamsim.report.sweep_figure import sweep_figure
from pamsim.sweeps import simulated
from pamsim.sweeps.run_table import CHUNKS
from pamsim.sweeps.study import read_study
from pamsim.sweeps.sweep import sweep

STEP = {
    "start_pressure": [300, 300], "final": [300, 100], "duration": 0.3, "settle": 0.5,
}  # fmt: skip
STUDY = {
    "schema": "pamsim-sweep/1",
    "design": "grid",
    "experiment": STEP,
    "vary": {"load": {"values": [0, 1.5]}, "chamber.dead_volume": {"values": [5, 10, 20]}},
}


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    return sweep(STUDY, out=tmp_path_factory.mktemp("sweep"))


@pytest.fixture
def small_blocks(monkeypatch):
    monkeypatch.setattr(simulated, "BLOCK", 2)


def bytes_of(result):
    return Path(result.table).read_bytes()


def test_every_row_is_the_simulation_of_its_values(finished):
    columns = finished.columns()
    rig = pamsim.load_rig("mas20_arm")
    assert columns["run"].tolist() == list(range(6))
    for run in (1, 5):
        load, volume = columns["load"][run], columns["chamber.dead_volume"][run]
        step = pamsim.Experiment(
            drive="pressure_set", command_time=np.zeros(1), command_value=[[300e3, 100e3]],
            start_pressure=[300e3, 300e3], duration=0.3, settle=0.5, sample_rate=200.0, load=load,
        )  # fmt: skip
        alone = pamsim.simulate(rig.with_parameters({"chamber.dead_volume": volume * 1e-6}), step)
        for name, value in step_figures(alone).items():
            assert columns[name][run] == pytest.approx(value, rel=1e-12, abs=1e-12, nan_ok=True)
    assert set(columns["outcome"]) == {"completed"}
    assert finished.rank_correlations["final_deg"]["chamber.dead_volume"] < -0.5
    assert "6 runs, 0 of them failed" in finished.summary()
    drawn = min(len(finished.rank_correlations), 4)  # outputs, beside two factors
    assert len(sweep_figure(finished).axes) == 2 * drawn > 0


def test_runs_of_equal_rigs_come_to_rest_once(monkeypatch, tmp_path):
    settled = []
    real = batch.settle_quickly
    monkeypatch.setattr(batch, "settle_quickly", lambda *args: (settled.append(1), real(*args)))
    volumes = {"chamber.dead_volume": {"values": [5, 10]}}
    found = sweep(
        {**STUDY, "vary": {**volumes, "final_2": {"values": [50, 100, 150]}}}, out=tmp_path
    )
    assert len(settled) == 2  # one for each dead volume, not for each of the six runs
    assert set(found.columns()["outcome"]) == {"completed"}


def test_columns_carry_their_units(finished):
    schema = parquet.read_schema(finished.table)
    units = {f.name: (f.metadata or {}).get(b"unit", b"").decode() for f in schema}
    assert (units["chamber.dead_volume"], units["load"]) == ("cm^3", "kg")
    assert (units["final_deg"], units["final_pressure_1_kpa"], units["outcome"]) == (
        "deg", "kPa", "",
    )  # fmt: skip


@pytest.mark.usefixtures("small_blocks")
def test_an_executor_gives_the_same_table_and_the_job_can_travel(finished, tmp_path):
    job = read_study(STUDY).job
    assert pickle.loads(pickle.dumps(job)) == job
    with ThreadPoolExecutor(3) as pool:
        elsewhere = sweep(STUDY, out=tmp_path, executor=pool)
    assert parquet.read_table(elsewhere.table).equals(parquet.read_table(finished.table))


@pytest.mark.usefixtures("small_blocks")
def test_an_interrupted_sweep_goes_on_and_repeats_nothing(finished, tmp_path, monkeypatch):
    counted = []

    def interrupted(jobs, **options):
        if len(counted) == 2:
            raise KeyboardInterrupt
        counted.append(len(jobs))
        return simulate_batch(jobs, **options)

    monkeypatch.setattr(simulated, "simulate_batch", interrupted)
    with pytest.raises(KeyboardInterrupt):
        sweep(STUDY, out=tmp_path)
    chunks = sorted((tmp_path / CHUNKS).glob("*.parquet"))
    assert len(chunks) == 2
    damaged = bytearray(chunks[0].read_bytes())
    damaged[40] ^= 0xFF
    chunks[0].write_bytes(bytes(damaged))
    counted[:] = [0, 0, 0]  # never two again
    resumed = sweep(STUDY, out=tmp_path, resume=True)
    assert counted == [0, 0, 0, 2, 2]  # the damaged block and the one that was missing
    assert resumed.kept == 2
    assert parquet.read_table(resumed.table).equals(parquet.read_table(finished.table))
    assert not (tmp_path / CHUNKS).exists()
    again = sweep(STUDY, out=tmp_path, resume=True)
    assert (again.kept, len(counted)) == (6, 5)
    assert bytes_of(again) == bytes_of(resumed)


def test_another_study_does_not_go_on(finished):
    folder = finished.table.parent
    other = {**STUDY, "experiment": {**STEP, "duration": 0.4}}
    with pytest.raises(InputError, match="of another study, rig or version"):
        sweep(other, out=folder, resume=True)
    with pytest.raises(InputError, match="holds no sweep"):
        sweep(STUDY, out=folder / "nothing", resume=True)


def test_a_run_that_is_refused_has_a_row_and_stops_no_other(tmp_path):
    vary = {"load": {"values": [0, -1, 1]}, "final_2": {"values": [100, 100, 1e5]}}
    study = {**STUDY, "design": "rows", "vary": vary}
    result = sweep(study, out=tmp_path)
    columns = result.columns()
    assert columns["outcome"].tolist() == ["completed", "refused", "refused"]
    assert "load" in columns["message"][1]
    assert "100000 kPa" in columns["message"][2] or "supply" in columns["message"][2]
    assert np.isfinite(columns["final_deg"]).tolist() == [True, False, False]
    assert result.failed == 2
    assert result.to_dict()["outputs"]["final_deg"]["runs"] == 1


def test_effects_and_rigs_vary_too(tmp_path):
    vary = {"rig": {"values": ["mas20_arm"]}, "coulomb_friction": {"values": [0, 1]}}
    result = sweep({**STUDY, "vary": vary}, out=tmp_path)
    columns = result.columns()
    assert columns["rig"].tolist() == ["mas20_arm"] * 2
    assert columns["final_deg"][0] > columns["final_deg"][1]  # friction holds it back
    (panel,) = sweep_figure(result).axes  # two runs are too few for a correlation
    assert "no output varies" in panel.texts[0].get_text()


def test_a_sensitivity_study_states_indices(tmp_path):
    vary = {"load": {"low": 0, "high": 0.05}, "chamber.dead_volume": {"low": 5, "high": 50}}
    study = {**STUDY, "design": "sensitivity", "runs": 4, "vary": vary}
    result = sweep(study, out=tmp_path)
    assert result.runs == 16
    indices = result.sobol["final_deg"]
    assert indices["chamber.dead_volume"].total > indices["load"].total
    assert "share of its variance (total index): chamber.dead_volume" in result.summary()
    assert result.to_dict()["sobol"]["final_deg"]["load"]["first_interval95"]


def test_a_lost_worker_ends_the_sweep_in_words(tmp_path):
    from concurrent.futures.process import BrokenProcessPool

    class Lost(ThreadPoolExecutor):
        def submit(self, *_, **__):
            future = super().submit(int)
            future.result()
            broken = type(future)()
            broken.set_exception(BrokenProcessPool("gone"))
            return broken

    with Lost(1) as pool, pytest.raises(EngineError, match="go on with `resume`"):
        sweep(STUDY, out=tmp_path, executor=pool)
    with Lost(1) as pool, pytest.raises(InputError, match="an executor has workers of its own"):
        sweep(STUDY, out=tmp_path, executor=pool, threads=2)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"schema": "pamsim-sweep/9"}, "schema is 'pamsim-sweep/9'; it must be 'pamsim-sweep/1'"),
        ({"designs": "grid"}, "no key 'designs'; did you mean 'design'"),
        ({"design": "grids"}, "no design 'grids'; did you mean 'grid'"),
        ({"rig": 3}, "rig must be the name"),
        ({"runs": -1}, "runs is -1"),
        ({"experiment": 3}, "needs a table"),
        ({"experiment": {**STEP, "load_kg": 1}}, "experiment.load_kg is not known"),
        ({"experiment": {**STEP, "drive": "pulse"}}, "drive is 'pulse'; it may be pressure_set"),
        ({"experiment": {**STEP, "final": [1]}}, "a number for each of the 2 muscles"),
        ({"experiment": {**STEP, "duration": "x"}}, "duration is 'x'; it must be a number"),
        ({"experiment": {"start_pressure": [1, 1], "final": [1, 1]}}, "duration is missing"),
        ({"vary": {"chamber.dead_volum": {"values": [1]}}}, "did you mean 'chamber.dead_volume'"),
        ({"vary": {"final_3": {"values": [1]}}}, "mas20_arm has 2 muscles"),
        ({"vary": {"load": {"values": [1], "unit": "m"}}}, "unit 'm' does not measure"),
        ({"vary": {"air_leak": {"values": [1], "unit": "m"}}}, "an effect has no unit"),
        ({"vary": {"rig": {"values": ["mas20_arm", "two_joint_arm"]}}}, "other joints or muscles"),
    ],
)
def test_a_study_that_cannot_be_run_is_one_line(change, message):
    with pytest.raises(InputError, match=re.escape(message)):
        read_study({**STUDY, **change})


def test_a_study_that_is_not_there_or_no_toml_names_its_file(tmp_path):
    with pytest.raises(InputError, match="no study"):
        read_study(tmp_path / "study.toml")
    (tmp_path / "bad.toml").write_text("schema = ", encoding="utf-8")
    with pytest.raises(InputError, match="not valid TOML"):
        read_study(tmp_path / "bad.toml")
