"""A stop that no effect names is learned as a torque over the angle, and written into a rig."""

from __future__ import annotations

import math

import numpy as np
import pytest

import pamsim
from pamsim.comparison.measurements import read_calibration_data
from pamsim.diagnosis.options import Options
from pamsim.diagnosis.recordings import diagnose_recordings
from tests.plant.hide import hide

SIZE = 0.3  # in typical sizes of 4 N m/rad, from 8 deg on


def diagnosed(folder, effects):
    rig = pamsim.load_rig("mas20_arm")
    hidden = hide(
        rig, effects, protocols=("triangle", "staircase", "multisine"), duration=5.0, repeats=3,
        forces=False, formulation="plant", seed=3, step=7e-4,
    )  # fmt: skip
    hidden.save(folder / "data")
    data = read_calibration_data([str(folder / "data")])
    return diagnose_recordings(data, rig, Options(effects=("muscle_mismatch",)))


@pytest.mark.slow
def test_a_stop_that_has_no_name_is_learned_and_the_gap_shrinks(tmp_path):
    report = diagnosed(tmp_path, {"soft_stop": SIZE})
    (curve,) = report.learned
    assert (curve.joint, curve.over, curve.resembles) == ("shaft", "position", "stop")
    assert curve.before > 2.5
    assert curve.after < 1.15
    stiffness = 4.0 * SIZE * math.pi / 180.0
    assert curve.numbers["begin"] == pytest.approx(8.0, abs=2.0)
    assert curve.numbers["stiffness"] == pytest.approx(stiffness, rel=0.25)
    true = -stiffness * np.maximum(curve.at - 8.0, 0.0)
    visited = np.abs(curve.at) < 25.0
    assert np.sqrt(np.mean((curve.torque - true)[visited] ** 2)) < 0.1 * np.abs(true).max()
    assert "Without a name" in report.sentence
    report.save(tmp_path / "out")
    repaired = pamsim.load_rig(tmp_path / "out" / "rig")
    assert repaired.muscles["muscle_1"].learned.high > repaired.muscles["muscle_1"].learned.low
    gap = report.gap["angle"]
    assert gap.after < 0.5 * gap.before


@pytest.mark.slow
def test_nothing_is_learned_where_nothing_is_missing(tmp_path):
    report = diagnosed(tmp_path, {})
    assert report.learned == ()
    assert "Without a name" not in report.sentence
