"""Inputs of a machine that moves the joints: safe at every seed, equal at one, different at two."""

from __future__ import annotations

import numpy as np
import pytest

import pamsim
from pamsim.comparison.experiments import as_read
from pamsim.comparison.imposed_motion import IMPOSED_MOTIONS
from pamsim.comparison.measurements import read_calibration_data
from pamsim.comparison.protocols import PROTOCOLS
from pamsim.comparison.trial_prediction import TrialPredictor
from pamsim.core.errors import InputError
from pamsim.engine.simulate import prepare
from pamsim.twins.hide import hide
from tests.plant import hide as plant

SEEDS = range(40)


@pytest.fixture(scope="module")
def bench():
    return pamsim.load_rig("muscle_bench")


@pytest.mark.parametrize("name", IMPOSED_MOTIONS)
def test_no_seed_leaves_the_range_of_the_joint_or_of_the_supply(bench, name):
    assert name not in PROTOCOLS
    low, high = bench.model.joint("rod").range
    for seed in SEEDS:
        pressure, position = IMPOSED_MOTIONS[name].experiment(bench, seed).command_value.T
        assert pressure.min() >= 3e4
        assert pressure.max() <= 0.8 * bench.supply_pressure
        assert low < position.min() <= position.max() < high


@pytest.mark.parametrize("name", IMPOSED_MOTIONS)
def test_the_same_seed_gives_the_same_and_every_joint_is_moved(name):
    rig = pamsim.load_rig("two_joint_arm")
    one, same, other = (IMPOSED_MOTIONS[name].experiment(rig, seed, 2.0) for seed in (1, 1, 2))
    assert np.array_equal(one.command_value, same.command_value)
    assert not np.array_equal(one.command_value, other.command_value)
    assert one.drives.joints == {"shoulder": "angle", "elbow": "angle"}
    assert prepare(rig, one).external.dofs.tolist() == [0, 1]


def test_what_is_imposed_is_not_compared_and_what_it_takes_is(bench, tmp_path):
    hidden = hide(bench, {}, protocols=("stretch",), duration=0.5, repeats=1, variation=0.0)
    hidden.save(tmp_path / "data")
    data = read_calibration_data([tmp_path / "data"]).of_rig(bench)
    predictor = TrialPredictor(bench, data, threads=1)
    trial = data.trials[0]
    assert trial.drive == {"muscle": "pressure_set", "rod": "length"}
    assert set(predictor.compared(trial)) == {"muscle.pressure", "muscle.force", "rod.force"}
    (found,) = predictor.predictions([bench])
    assert found is not None
    for channel, noise in (("muscle.force", 1.5), ("rod.force", 1.5), ("muscle.pressure", 400.0)):
        off = found.trials[trial.name][channel] - trial.measured[channel]
        assert np.sqrt(np.mean(off**2)) < 1.3 * noise


def test_an_encoder_with_errors_is_believed_as_it_reads(bench, tmp_path):
    """The true motion is what the encoder read without its errors, as with pressures."""
    wrong = bench.with_parameters({"sensor.angle_bias": 0.002, "sensor.angle_scale": 1.1})
    made = IMPOSED_MOTIONS["stretch"].experiment(bench, 0, 0.5)
    true = as_read(wrong, made).command_value[:, 1]
    np.testing.assert_allclose(1.1 * true + 0.002, made.command_value[:, 1], rtol=1e-12)


def test_a_joint_without_range_cannot_be_moved(bench, monkeypatch):
    monkeypatch.setattr(bench.model, "jnt_limited", np.zeros_like(bench.model.jnt_limited))
    with pytest.raises(InputError, match="'rod' has no range"):
        IMPOSED_MOTIONS["stretch"].experiment(bench)


def test_a_plant_without_machine_refuses_it(bench):
    arm = pamsim.load_rig("mas20_arm")
    with pytest.raises(InputError, match="the independent plant takes pressures"):
        plant.hide(arm, {}, protocols=("isometric",), duration=0.5, repeats=1)
