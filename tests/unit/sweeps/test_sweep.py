"""A sweep's table holds what single simulations give, however it was computed."""

from __future__ import annotations

import pickle
import shutil
import time
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool

import numpy as np
import pytest
from pyarrow import parquet

import pamsim
from pamsim.core.errors import EngineError
from pamsim.engine import batch
from pamsim.engine.batch import simulate_batch
from pamsim.recordings.rig_file import shipped_rigs
from pamsim.report.sweep_figure import sweep_figure, write_sweep
from pamsim.sweeps import simulated
from pamsim.sweeps.run_table import CHUNKS
from pamsim.sweeps.study import read_study
from pamsim.sweeps.sweep import sweep
from tests.unit.core.refusals import refused

STEP = {
    "start_pressure": [300, 300], "final": [300, 100], "duration": 0.3, "settle": 0.5,
}  # fmt: skip
STUDY = {
    "schema": "pamsim-sweep/1",
    "design": "grid",
    "experiment": STEP,
    "vary": {"load": {"values": [0, 1.5]}, "chamber.dead_volume": {"values": [5, 10, 20]}},
}
RECORDED = {"protocols": ["bursts"], "repeats": 3, "duration": 1.0}
CALIBRATE = {
    "schema": "pamsim-sweep/1",
    "job": "calibrate",
    "experiment": {**RECORDED, "channels": ["angle", "pressure"]},
    "vary": {"joint.shaft.damping": {"values": [0.3, 0.45]}, "seed": {"values": [5]}},
}
DIAGNOSE = {
    "schema": "pamsim-sweep/1",
    "job": "diagnose",
    "experiment": {
        # In a second a laminar leak fits as well.
        **RECORDED, "repeats": 5, "duration": 2.0, "forces": False, "effects": ["air_leak"],
    },
    "vary": {"air_leak": {"values": [0, 3]}},
}  # fmt: skip


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    return sweep(STUDY, out=tmp_path_factory.mktemp("sweep"))


@pytest.fixture
def small_blocks(monkeypatch):
    monkeypatch.setattr(simulated, "BLOCK", 2)


def same_table(one, other):
    return parquet.read_table(one.table).equals(parquet.read_table(other.table))


def test_a_table_has_a_row_for_every_run_and_units(finished):
    columns = finished.columns()
    assert columns["run"].tolist() == list(range(6))
    assert set(columns["outcome"]) == {"completed"}
    assert finished.rank_correlations["final_deg"]["chamber.dead_volume"] < -0.5
    assert "6 runs, 0 of them failed" in finished.summary()
    drawn = min(len(finished.rank_correlations), 4)  # outputs, beside two factors
    assert len(pamsim.plot(finished).axes) == 2 * drawn > 0
    schema = parquet.read_schema(finished.table)
    units = {f.name: (f.metadata or {}).get(b"unit", b"").decode() for f in schema}
    stated = {"chamber.dead_volume": "cm^3", "load": "kg", "final_deg": "deg",
              "final_pressure_1_kpa": "kPa", "outcome": ""}  # fmt: skip
    assert {name: units[name] for name in stated} == stated


def test_runs_of_equal_rigs_come_to_rest_once(monkeypatch, tmp_path):
    settled = []
    real = batch.settle
    monkeypatch.setattr(batch, "settle", lambda *args: (settled.append(1), real(*args)))
    vary = {"chamber.dead_volume": {"values": [5, 10]}, "final_2": {"values": [50, 100, 150]}}
    found = sweep({**STUDY, "vary": vary}, out=tmp_path)
    assert len(settled) == 2  # one for each dead volume, not for each of the six runs
    assert set(found.columns()["outcome"]) == {"completed"}


@pytest.mark.usefixtures("small_blocks")
def test_an_executor_gives_the_same_table_and_a_job_can_travel(finished, tmp_path):
    for study in (STUDY, CALIBRATE, DIAGNOSE):
        job = read_study(study).job
        assert pickle.loads(pickle.dumps(job)) == job
    with ThreadPoolExecutor(3) as pool:
        assert same_table(sweep(STUDY, out=tmp_path, executor=pool), finished)


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
    assert same_table(resumed, finished)
    assert not (tmp_path / CHUNKS).exists()
    before = resumed.table.read_bytes()
    again = sweep(STUDY, out=tmp_path, resume=True)
    assert (again.kept, len(counted)) == (6, 5)
    assert again.table.read_bytes() == before
    # Another study does not go on.
    with refused("of another study, rig or version"):
        sweep({**STUDY, "experiment": {**STEP, "duration": 0.4}}, out=tmp_path, resume=True)
    with refused("holds no sweep"):
        sweep(STUDY, out=tmp_path / "nothing", resume=True)


def test_a_study_is_another_if_the_rig_s_files_are(tmp_path):
    folder = shutil.copytree(shipped_rigs() / "mas20_arm", tmp_path / "arm")
    params, marks = folder / "params.toml", []
    for line in ("", "# an interval, or a size of an effect, may have changed"):
        params.write_text(f"{params.read_text(encoding='utf-8')}{line}\n", encoding="utf-8")
        marks.append(read_study({**STUDY, "rig": str(folder)}).fingerprint)
    assert marks[0] != marks[1]


def test_a_run_that_is_refused_has_a_row_and_stops_no_other(tmp_path):
    vary = {"load": {"values": [0, -1, 1]}, "final_2": {"values": [100, 100, 1e5]}}
    result = sweep({**STUDY, "design": "rows", "vary": vary}, out=tmp_path / "steps")
    columns = result.columns()
    assert columns["outcome"].tolist() == ["completed", "refused", "refused"]
    assert "load" in columns["message"][1]
    assert "100000 kPa" in columns["message"][2] or "supply" in columns["message"][2]
    assert np.isfinite(columns["final_deg"]).tolist() == [True, False, False]
    assert result.failed == 2
    assert f"2 of them failed; the first: {columns['message'][1]}\n" in result.summary()
    assert result.to_dict()["outputs"]["final_deg"]["runs"] == 1
    vary = {**CALIBRATE["vary"], "repeats": {"values": [0, 2.5]}}
    vary["joint.shaft.damping"] = {"values": [0.3]}
    columns = sweep({**CALIBRATE, "vary": vary}, out=tmp_path / "fits").columns()
    assert columns["outcome"].tolist() == ["refused"] * 2
    assert "0 repeats" in columns["message"][0]
    assert "vary.repeats is 2.5; it must be a whole number" in columns["message"][1]


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
    total = indices["chamber.dead_volume"].total
    low, high = indices["chamber.dead_volume"].total_interval95
    assert f"chamber.dead_volume {total:.2f} [{low:.2f}, {high:.2f}], load " in result.summary()
    assert result.to_dict()["sobol"]["final_deg"]["load"]["first_interval95"]


def test_a_calibration_finds_the_damping_that_each_run_plants(tmp_path):
    began = time.perf_counter()
    found = sweep(CALIBRATE, out=tmp_path)
    elapsed = time.perf_counter() - began
    columns, planted = found.columns(), [0.3, 0.45]
    assert found.failed == 0
    assert columns["true.joint.shaft.damping"].tolist() == planted
    assert columns["found.joint.shaft.damping"] == pytest.approx(planted, rel=0.03)
    low, high = columns["low.joint.shaft.damping"], columns["high.joint.shaft.damping"]
    inside = [float(a <= true <= b) for a, true, b in zip(low, planted, high, strict=True)]
    assert columns["inside.joint.shaft.damping"].tolist() == inside
    assert set(columns["status"]) == {"converged"}
    assert (columns["seconds"] > 0.0).all()
    assert columns["seconds"].sum() < elapsed
    stated = {"found": "N*m*s/rad", "low": "N*m*s/rad", "inside": "1"}
    for part, unit in stated.items():
        assert found.outputs[f"{part}.joint.shaft.damping"].unit == unit


def test_bounds_of_a_study_hold_what_is_calibrated(tmp_path):
    bounds = {"joint.shaft.damping": [0.32, 0.6]}
    vary = {"joint.shaft.damping": {"values": [0.3]}, "seed": {"values": [5]}}
    experiment = {**CALIBRATE["experiment"], "bounds": bounds}
    columns = sweep({**CALIBRATE, "experiment": experiment, "vary": vary}, out=tmp_path).columns()
    assert columns["found.joint.shaft.damping"] == pytest.approx([0.32], rel=0.01)


def test_a_diagnosis_names_the_leak_that_is_there_and_none_that_is_not(tmp_path):
    found = sweep(DIAGNOSE, out=tmp_path)
    columns = found.columns()
    assert found.failed == 0
    without, leaking = columns["verdict"].tolist()
    assert without == "no_gap"
    assert leaking.startswith("named")
    assert columns["named"].tolist() == ["", "air_leak"]
    (name,) = (n.removeprefix("found.") for n in columns if n.startswith("found."))
    true, size = columns[f"true.{name}"], columns[f"found.{name}"]
    assert true[0] == 0.0 < true[1]
    assert size[1] == pytest.approx(true[1], rel=0.3)
    assert np.isnan(size[0])  # nothing was claimed
    assert columns[f"low.{name}"][1] < size[1] < columns[f"high.{name}"][1]
    assert "<b>2</b> 0 of them failed" in write_sweep(found, tmp_path).read_text(encoding="utf-8")


def test_a_lost_worker_ends_the_sweep_in_words(tmp_path):
    class Lost(ThreadPoolExecutor):
        def submit(self, *_, **__):
            future = super().submit(int)
            future.result()
            broken = type(future)()
            broken.set_exception(BrokenProcessPool("gone"))
            return broken

    with Lost(1) as pool, refused("go on with `resume`", error=EngineError):
        sweep(STUDY, out=tmp_path, executor=pool)
    with Lost(1) as pool, refused("an executor has workers of its own"):
        sweep(STUDY, out=tmp_path, executor=pool, threads=2)
    with refused("`threads` is 0"):  # or every run would be refused, each by itself
        sweep(STUDY, out=tmp_path, threads=0)


def test_a_study_that_cannot_be_run_is_one_line(tmp_path):
    twice = {"rig": {"values": ["mas20_arm", "two_joint_arm"]}}
    refusals = (
        (STUDY, {"schema": "pamsim-sweep/9"}, 'write schema = "pamsim-sweep/1"'),
        (STUDY, {"designs": "grid"}, "unknown key designs; did you mean 'design'"),
        (STUDY, {"design": "grids"}, "no design 'grids'; did you mean 'grid'"),
        (STUDY, {"rig": 3}, "rig = 3; write rig = "),
        (STUDY, {"runs": -1}, "runs = -1; write runs = a whole"),
        (STUDY, {"experiment": 3}, "as a table [experiment]"),
        (STUDY, {"experiment": {**STEP, "load_kg": 1}}, "experiment: unknown key load_kg"),
        (STUDY, {"experiment": {**STEP, "drive": "pulse"}}, "'pulse'; write drive = pressure_set"),
        (
            STUDY,
            {"experiment": {**STEP, "drive": ["valve"]}},
            "write drive = pressure_set or valve",
        ),
        (STUDY, {"runs": 3}, "runs is 3; the runs of a design"),
        (STUDY, {"experiment": {**STEP, "final": [1]}}, "a number for each of the 2 muscles"),
        (STUDY, {"experiment": {**STEP, "duration": "x"}}, "duration = 'x'; write duration = the"),
        (
            STUDY,
            {"experiment": {"start_pressure": [1, 1], "final": [1, 1]}},
            "experiment needs duration = the",
        ),
        (STUDY, {"vary": {"chamber.dead_volum": {"values": [1]}}}, "mean 'chamber.dead_volume'"),
        (STUDY, {"vary": {"final_3": {"values": [1]}}}, "mas20_arm has 2 muscles"),
        (STUDY, {"vary": {"load": {"values": [1], "unit": "m"}}}, "unit 'm' does not measure"),
        (STUDY, {"vary": {"air_leak": {"values": [1], "unit": "m"}}}, "an effect has no unit"),
        (STUDY, {"vary": twice}, "other joints or muscles"),
        (CALIBRATE, {"job": "diagnosis"}, "no job 'diagnosis'"),
        (CALIBRATE, {"experiment": {"final": [1]}}, "experiment: unknown key final"),
        (
            CALIBRATE,
            {"experiment": {"bounds": {"force.a": 5}}},
            "force.a = 5; write force.a = [low",
        ),
        (CALIBRATE, {"experiment": {"repeats": 1.5}}, "repeats = 1.5; write repeats = a whole"),
        (CALIBRATE, {"experiment": {"protocols": "steps"}}, "protocols = 'steps'; write"),
        (CALIBRATE, {"vary": {"seed": {"values": [1]}}}, "experiment.free is missing"),
        (CALIBRATE, {"vary": {"duration": {"values": [1], "unit": "kg"}}}, "vary.duration"),
    )
    for study, change, message in refusals:
        with refused(message):
            read_study({**study, **change})
    file = tmp_path / "study.toml"
    with refused("no study"):
        read_study(file)
    file.write_text("schema = ", encoding="utf-8")
    with refused("not valid TOML"):
        read_study(file)
