"""Force lost to the ends: none before the onset, no kink at it, never more than all."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pamsim.physics.tension import EndShape, force_left

KAPPA = np.linspace(-0.2, 0.5, 7001)


@pytest.mark.parametrize("onset", [-0.05, 0.0, 0.12])
@pytest.mark.parametrize("loss", [0.1, 0.6, 1.0])
def test_loss_sets_in_smoothly_and_only_grows(loss, onset):
    ends = EndShape(loss=loss, onset=onset)
    left, stated = np.array([force_left(ends, k) for k in KAPPA.tolist()]).T
    step = KAPPA[1] - KAPPA[0]
    assert np.all(left[onset >= KAPPA] == 1.0)
    assert np.all(np.diff(left[onset + step < KAPPA]) < 0.0)
    assert np.all((left >= 1.0 - loss) & (left <= 1.0))
    slope = np.diff(left) / step
    assert slope == pytest.approx(0.5 * (stated[:-1] + stated[1:]), abs=2e-4 * loss)
    assert np.abs(np.diff(slope)).max() <= 2.0 * loss / 0.1**2 * step * (1.0 + 1e-3)  # bounded bend


@pytest.mark.parametrize("onset", [-0.05, 0.1])
def test_half_of_the_loss_is_reached_a_tenth_beyond_the_onset(onset):
    ends = EndShape(loss=0.4, onset=onset)
    assert force_left(ends, onset + 0.1)[0] == pytest.approx(0.8, rel=1e-12)
    assert force_left(ends, onset + 100.0)[0] == pytest.approx(0.6, rel=1e-5)


def test_without_loss_nothing_is_lost_and_nan_is_not_hidden():
    assert all(force_left(EndShape(), k) == (1.0, 0.0) for k in KAPPA.tolist())
    assert math.isnan(force_left(EndShape(loss=0.3), math.nan)[0])
