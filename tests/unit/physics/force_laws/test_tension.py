"""What turns a force into a tension: no push, a threshold, and the share that the ends lose."""

import math

import numpy as np
import pytest

from pamsim.physics.tension import (
    EndShape,
    Threshold,
    effective_pressure,
    force_left,
    pressure_reaching,
    taut,
)


def test_tension_is_never_negative_and_leaves_a_pull_alone():
    for force in (-1e4, -1e-300, 0.0, 1e-300, 1e4, *np.linspace(-10.0, 10.0, 41).tolist()):
        assert taut(force) == max(force, 0.0)
    assert math.isnan(taut(math.nan))


def test_threshold_shifts_the_pressure_stops_at_zero_and_is_neutral_to_the_bit():
    pressures = [0.0, 5e-324, *np.linspace(-5e4, 6e5, 131).tolist()]
    for threshold in (0.0, 1.0, 3e4):
        for pressure in pressures:
            assert effective_pressure(pressure, threshold) == max(pressure - threshold, 0.0)
        assert math.isnan(effective_pressure(math.nan, threshold))
    assert Threshold().pressure == 0.0


@pytest.mark.parametrize("width", [0.0, 1e4, 5e4])
def test_a_gradual_threshold_loses_half_at_its_width_and_all_in_the_end(width):
    felt = [effective_pressure(p, 3e4, width) for p in np.linspace(-5e4, 6e5, 131).tolist()]
    assert np.all(np.diff(felt) >= 0.0)
    assert felt[0] == 0.0
    assert effective_pressure(1e9, 3e4, width) == pytest.approx(1e9 - 3e4, abs=2.0)
    if width > 3e4:  # else the half lies below the threshold
        assert effective_pressure(width, 3e4, width) == pytest.approx(width - 1.5e4)
    for pressure in (2.1e4, 2e5):
        step = 1e-2
        low, high = (effective_pressure(pressure + x, 3e4, width) for x in (-step, step))
        slope = (high - low) / (2.0 * step)
        assert pressure_reaching(pressure, 3e4, width) == pytest.approx(slope, abs=1e-7)


@pytest.mark.parametrize("onset", [-0.05, 0.0, 0.12])
def test_the_ends_loss_sets_in_smoothly_only_grows_and_is_half_a_tenth_beyond_the_onset(onset):
    kappa = np.linspace(-0.2, 0.5, 7001)
    step = kappa[1] - kappa[0]
    for loss in (0.1, 1.0):
        ends = EndShape(loss=loss, onset=onset)
        left, stated = np.array([force_left(ends, k) for k in kappa.tolist()]).T
        assert np.all(left[onset >= kappa] == 1.0)
        assert np.all(np.diff(left[onset + step < kappa]) < 0.0)
        assert np.all((left >= 1.0 - loss) & (left <= 1.0))
        slope = np.diff(left) / step
        assert slope == pytest.approx(0.5 * (stated[:-1] + stated[1:]), abs=2e-4 * loss)
        bend = 2.0 * loss / 0.1**2 * step * (1.0 + 1e-3)
        assert np.abs(np.diff(slope)).max() <= bend
        assert force_left(ends, onset + 0.1)[0] == pytest.approx(1.0 - 0.5 * loss, rel=1e-12)
        assert force_left(ends, onset + 100.0)[0] == pytest.approx(1.0 - loss, abs=1e-5)
        assert math.isnan(force_left(ends, math.nan)[0])
    assert force_left(EndShape(onset=onset), 0.3) == (1.0, 0.0)
