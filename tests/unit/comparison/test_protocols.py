"""Inputs of synthetic recordings: safe at every seed, equal at one seed, different at two."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

import pamsim
from pamsim.comparison.experiments import as_read
from pamsim.comparison.measurements import read_calibration_data
from pamsim.comparison.protocols import DURATION, IMPOSED_MOTIONS, PROTOCOLS, RATE, protocol
from pamsim.comparison.trial_prediction import TrialPredictor
from pamsim.core.errors import InputError
from pamsim.engine.simulate import prepare
from pamsim.twins.hide import hide
from tests.plant import hide as plant

SEEDS = range(40)
SUPPLY = 6e5  # of the arm they are for [Pa]


def command_of(name, seed=3, **options):
    return PROTOCOLS[name].experiment(seed, **options).command_value


@pytest.mark.parametrize("name", PROTOCOLS)
def test_no_seed_is_unsafe_or_repeats_another_but_for_sign_and_scale(name):
    """A held-out setting that repeats the fitted one would judge nothing."""
    commands = [command_of(name, seed) for seed in SEEDS]
    assert np.array_equal(commands[0], command_of(name, 0))
    for command in commands:
        assert command.shape == (round(DURATION * RATE), 2)
        if PROTOCOLS[name].command == "pressure_set":
            assert command.min() >= 1e4
            assert command.max() <= 0.8 * SUPPLY
        else:
            assert np.abs(command).max() <= 1.0
    equal = []
    for one, other in itertools.pairwise(commands):
        first, second = (run - run.mean(axis=0) for run in (one, other))
        power = np.sum(first**2) * np.sum(second**2)
        equal.append(abs(np.sum(first * second)) / np.sqrt(power))
    assert max(equal) < 0.99999  # chance may draw two that are close
    assert np.median(equal) < 0.95


def test_pressures_are_lower_in_proportion_under_a_weak_supply_and_no_higher_under_a_strong():
    for name, one in PROTOCOLS.items():
        usual, weak, strong = (one.experiment(3, supply=supply) for supply in (5e5, 1e5, 1e6))
        share = 0.2 if one.command == "pressure_set" else 1.0
        np.testing.assert_allclose(weak.command_value, share * usual.command_value, err_msg=name)
        np.testing.assert_allclose(weak.start_pressure, 0.2 * usual.start_pressure)
        np.testing.assert_array_equal(strong.command_value, usual.command_value)
        assert max(weak.start_pressure) < 1e5


def test_cocontraction_moves_both_muscles_together_and_turns_the_arm_both_ways():
    for seed in SEEDS:
        command = command_of("cocontraction", seed)
        common, apart = command.mean(axis=1), np.diff(command, axis=1)
        assert np.ptp(common) > 2.5e5
        assert apart.min() < 0.0 < apart.max()
    with pytest.raises(InputError, match="did you mean 'bursts'"):
        protocol("burst")


def test_more_muscles_are_driven_in_pairs_each_in_its_own_way():
    for name in PROTOCOLS:
        pair = command_of(name)
        for muscles in (1, 3, 4):
            command = command_of(name, muscles=muscles)
            assert command.shape == (len(pair), muscles)
            assert np.array_equal(command[:, :2], pair[:, :muscles])
            assert all(not np.array_equal(pair[:, 0], own) for own in command[:, 2:3].T), name


@pytest.fixture(scope="module")
def bench():
    return pamsim.load_rig("muscle_bench")


def test_imposed_motion_leaves_the_range_of_no_joint_and_of_no_supply(bench):
    low, high = bench.model.joint("rod").range
    rig = pamsim.load_rig("two_joint_arm")
    for name, motion in IMPOSED_MOTIONS.items():
        assert name not in PROTOCOLS
        for seed in SEEDS:
            pressure, position = motion.experiment(bench, seed).command_value.T
            assert pressure.min() >= 3e4
            assert pressure.max() <= 0.8 * bench.supply_pressure
            assert low < position.min() <= position.max() < high
        one, same, other = (motion.experiment(rig, seed, 2.0) for seed in (1, 1, 2))
        assert np.array_equal(one.command_value, same.command_value)
        assert not np.array_equal(one.command_value, other.command_value)
        assert one.drives.joints == {"shoulder": "angle", "elbow": "angle"}
        assert prepare(rig, one).external.dofs.tolist() == [0, 1]
        weak = pamsim.load_rig("equimus_leg")
        assert motion.experiment(weak).command_value[:, :2].max() <= 0.9 * weak.supply_pressure


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


def test_an_error_of_a_sensor_moves_no_motion_beyond_the_stops(bench):
    """A rod held at its stop; the stops of 100 mm give way by 10 mm."""
    off = bench.with_parameters({"sensor.angle_bias": -0.05})
    made = IMPOSED_MOTIONS["stretch"].experiment(bench, 0, 0.5)

    def held(at):
        value = np.column_stack([made.command_value[:, 0], np.full(made.command_time.size, at)])
        return np.unique(as_read(off, replace(made, command_value=value)).command_value[:, 1])

    np.testing.assert_allclose(held(0.01), 0.02, rtol=1e-6)
    np.testing.assert_allclose(held(-0.08), -0.03, rtol=1e-6)
    np.testing.assert_allclose(held(0.04), 0.04)  # itself beyond: it stays, to be refused


def test_a_joint_without_range_and_a_plant_without_machine_refuse_motion(bench, monkeypatch):
    monkeypatch.setattr(bench.model, "jnt_limited", np.zeros_like(bench.model.jnt_limited))
    with pytest.raises(InputError, match="'rod' has no range"):
        IMPOSED_MOTIONS["stretch"].experiment(bench)
    arm = pamsim.load_rig("mas20_arm")
    with pytest.raises(InputError, match="the independent plant takes pressures"):
        plant.hide(arm, {}, protocols=("isometric",), duration=0.5, repeats=1)
