"""Inputs of synthetic recordings: safe at every seed, equal at one seed, different at two."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from pamsim.comparison.protocols import DURATION, PROTOCOLS, RATE, protocol
from pamsim.core.errors import InputError

SEEDS = range(40)
SUPPLY = 6e5  # of the arm they are for [Pa]


@pytest.mark.parametrize("name", PROTOCOLS)
def test_no_seed_asks_for_less_than_the_atmosphere_or_more_than_the_supply(name):
    for seed in SEEDS:
        command = PROTOCOLS[name].experiment(seed).command_value
        assert command.shape == (round(DURATION * RATE), 2)
        if PROTOCOLS[name].command == "pressure_set":
            assert command.min() >= 1e4
            assert command.max() <= 0.8 * SUPPLY
        else:
            assert np.abs(command).max() <= 1.0


@pytest.mark.parametrize("name", PROTOCOLS)
def test_pressures_are_lower_in_proportion_under_a_weak_supply_and_no_higher_under_a_strong(name):
    usual, weak, strong = (
        PROTOCOLS[name].experiment(3, supply=supply) for supply in (5e5, 1e5, 1e6)
    )
    pressures = PROTOCOLS[name].command == "pressure_set"
    share = 0.2 if pressures else 1.0
    np.testing.assert_allclose(weak.command_value, share * usual.command_value)
    np.testing.assert_allclose(weak.start_pressure, 0.2 * usual.start_pressure)
    np.testing.assert_array_equal(strong.command_value, usual.command_value)
    assert max(weak.start_pressure) < 1e5


@pytest.mark.parametrize("name", PROTOCOLS)
def test_two_settings_differ_in_more_than_a_sign_or_a_scale(name):
    """A held-out setting that repeats the fitted one would judge nothing."""
    runs = [PROTOCOLS[name].experiment(seed).command_value for seed in SEEDS]
    assert np.array_equal(runs[0], PROTOCOLS[name].experiment(0).command_value)
    equal = []
    for one, other in itertools.pairwise(runs):
        first, second = (run - run.mean(axis=0) for run in (one, other))
        power = np.sum(first**2) * np.sum(second**2)
        equal.append(abs(np.sum(first * second)) / np.sqrt(power))
    assert max(equal) < 0.99999  # chance may draw two that are close
    assert np.median(equal) < 0.95


def test_cocontraction_moves_both_muscles_together_and_turns_the_arm_both_ways():
    for seed in SEEDS:
        command = PROTOCOLS["cocontraction"].experiment(seed).command_value
        common, apart = command.mean(axis=1), np.diff(command, axis=1)
        assert np.ptp(common) > 2.5e5
        assert apart.min() < 0.0 < apart.max()


def test_an_unknown_name_is_refused_with_the_nearest():
    with pytest.raises(InputError, match="did you mean 'bursts'"):
        protocol("burst")


@pytest.mark.parametrize("name", PROTOCOLS)
@pytest.mark.parametrize("muscles", [1, 3, 4])
def test_more_muscles_are_driven_in_pairs_each_in_its_own_way(name, muscles):
    command = PROTOCOLS[name].experiment(3, muscles=muscles).command_value
    pair = PROTOCOLS[name].experiment(3).command_value
    assert command.shape == (len(pair), muscles)
    assert np.array_equal(command[:, :2], pair[:, :muscles])
    assert all(not np.array_equal(pair[:, 0], own) for own in command[:, 2:3].T)
