"""Sweeps of diagnoses and calibrations: what was planted is in the table beside what was found."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.report.sweep_figure import write_sweep
from pamsim.sweeps.study import read_study
from pamsim.sweeps.sweep import sweep

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
        **RECORDED, "repeats": 5, "duration": 2.0, "forces": False,
        "effects": ["air_leak", "coulomb_friction"],
    },
    "vary": {"air_leak": {"values": [0, 3]}},
}  # fmt: skip


def test_a_calibration_finds_the_damping_that_each_run_plants(tmp_path):
    found = sweep(CALIBRATE, out=tmp_path)
    columns = found.columns()
    assert found.failed == 0
    assert columns["true.joint.shaft.damping"].tolist() == [0.3, 0.45]
    assert columns["found.joint.shaft.damping"] == pytest.approx([0.3, 0.45], rel=0.03)
    low, high = columns["low.joint.shaft.damping"], columns["high.joint.shaft.damping"]
    inside = [a <= true <= b for a, true, b in zip(low, [0.3, 0.45], high, strict=True)]
    assert columns["inside.joint.shaft.damping"].tolist() == [float(one) for one in inside]
    assert set(columns["status"]) == {"converged"}
    assert (columns["seconds"] > 0.0).all()


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


def test_the_jobs_travel_to_other_processes():
    for study in (CALIBRATE, DIAGNOSE):
        job = read_study(study).job
        assert pickle.loads(pickle.dumps(job)) == job


def test_a_run_that_is_refused_has_a_row(tmp_path):
    study = {**CALIBRATE, "vary": {**CALIBRATE["vary"], "repeats": {"values": [0]}}}
    study["vary"]["joint.shaft.damping"] = {"values": [0.3]}
    columns = sweep(study, out=tmp_path).columns()
    assert columns["outcome"].tolist() == ["refused"]
    assert "0 repeats" in columns["message"][0]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"job": "diagnosis"}, "no job 'diagnosis'.*diagnose"),
        ({"experiment": {"final": [1]}}, "experiment.final: no such option"),
        ({"experiment": {"repeats": 1.5}}, "experiment.repeats is 1.5"),
        ({"experiment": {"protocols": "steps"}}, "experiment.protocols is 'steps'"),
        ({"vary": {"seed": {"values": [1]}}}, "experiment.free is missing"),
        ({"vary": {"duration": {"values": [1], "unit": "kg"}}}, "vary.duration"),
    ],
)
def test_what_a_study_cannot_ask_for_is_said(change, message):
    with pytest.raises(InputError, match=message):
        read_study({**CALIBRATE, **change})
