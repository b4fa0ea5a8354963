"""The motion wanted now, from the one wanted at the next sample."""

from __future__ import annotations

import pytest

from pamsim.controllers.wanted_now import wanted_now
from tests.unit.controllers.closed_loop import sight


@pytest.mark.parametrize("period", [0.01, 0.3])
def test_under_constant_acceleration_it_is_exact(period):
    def motion(t):
        return 0.2 + 0.7 * t - 1.5 * t * t, 0.7 - 3.0 * t, -3.0

    angle, rate, _ = motion(0.4)
    assert wanted_now(sight(wanted=motion(0.4 + period)), period) == pytest.approx((angle, rate))
