"""Recordings without commands: the measured pressures drive the rig."""

from __future__ import annotations

import numpy as np
import pytest

import pamsim
from pamsim.twins.hide import hide

SETTINGS = {
    "protocols": ("triangle", "multisine"),
    "duration": 1.5,
    "repeats": 3,
    "measured_drive": True,
    "seed": 3,
}
TRIED = ("viscous_friction", "air_leak", "valve_delay")


@pytest.fixture(scope="module")
def rig():
    rig = pamsim.load_rig("mas20_arm")
    rig.model.opt.timestep = 1e-3  # for synthetic data and fit
    return rig


def diagnosed(rig, effects, folder):
    hide(rig, effects, **SETTINGS).save(folder)
    return pamsim.diagnose(folder, rig=rig, effects=TRIED)


def test_it_is_read_back_with_the_pressures_as_what_drives_it(rig, tmp_path):
    hidden = hide(rig, {}, **SETTINGS)
    hidden.save(tmp_path / "data")
    header = next((tmp_path / "data").glob("triangle*_1.csv")).read_text().splitlines()[0]
    assert "p1_kpa" in header
    assert "set" not in header
    for trial in pamsim.read_recordings(tmp_path / "data").trials:
        assert trial.drive == "measured"
        written = hidden.trials[trial.name].pressure
        np.testing.assert_allclose(trial.command, written, rtol=0, atol=1.0)  # in steps of 1 Pa


def test_nothing_hidden_is_no_gap(rig, tmp_path):
    assert diagnosed(rig, {}, tmp_path / "data").verdict.value == "no_gap"


def test_friction_is_named_and_what_valves_do_is_not_claimed_to_be_seen(rig, tmp_path):
    result = diagnosed(rig, {"viscous_friction": 1.5, "air_leak": 3.0}, tmp_path / "data")
    assert [effect.name for effect in result.effects] == ["viscous_friction"]
    assert "valves and air" not in {one.link for one in result.links}
    (volume,) = (one for one in result.nuisance if one.parameter == "chamber.dead_volume")
    assert volume.by_link == {}
    assert any("valves, air and supply" in warning for warning in result.warnings)
