"""What turns a force into a tension: no push, no pull below the threshold, no hidden NaN."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pamsim.physics.tension import Threshold, effective_pressure, pressure_reaching, taut

FORCES = np.concatenate([[-1e4, -1e-300, 0.0, 1e-300, 1e4], np.linspace(-10.0, 10.0, 41)])


def test_tension_is_never_negative_and_leaves_a_pull_alone():
    for force in FORCES.tolist():
        assert taut(force) == max(force, 0.0)


def test_nan_is_passed_on():
    assert math.isnan(taut(math.nan))
    assert math.isnan(effective_pressure(math.nan, 0.0))
    assert math.isnan(effective_pressure(math.nan, 3e4))


@pytest.mark.parametrize("threshold", [0.0, 1.0, 3e4])
def test_threshold_shifts_the_pressure_and_stops_at_zero(threshold):
    for pressure in np.linspace(-5e4, 6e5, 131).tolist():
        felt = effective_pressure(pressure, threshold)
        assert felt == max(pressure - threshold, 0.0)


@pytest.mark.parametrize("width", [0.0, 1e4, 5e4])
def test_a_gradual_threshold_loses_half_at_its_width_and_all_in_the_end(width):
    pressures = np.linspace(-5e4, 6e5, 131).tolist()
    felt = [effective_pressure(pressure, 3e4, width) for pressure in pressures]
    assert np.all(np.diff(felt) >= 0.0)
    assert felt[0] == 0.0
    assert effective_pressure(1e9, 3e4, width) == pytest.approx(1e9 - 3e4, abs=2.0)
    if width > 3e4:  # else the half lies below the threshold
        assert effective_pressure(width, 3e4, width) == pytest.approx(width - 1.5e4)
    for pressure in (2.1e4, 2e5):
        step = 1e-2
        ends = [effective_pressure(pressure + x, 3e4, width) for x in (-step, step)]
        slope = (ends[1] - ends[0]) / (2.0 * step)
        assert pressure_reaching(pressure, 3e4, width) == pytest.approx(slope, abs=1e-7)


def test_neutral_threshold_leaves_the_pressure_as_it_is_to_the_bit():
    neutral = Threshold().pressure
    pressures = np.concatenate([[0.0, 5e-324], np.random.default_rng(1).uniform(0.0, 1e6, 200)])
    for pressure in pressures.tolist():
        assert effective_pressure(pressure, neutral).hex() == pressure.hex()
