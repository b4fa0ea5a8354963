"""The motion wanted now, from the one wanted at the next sample."""

from __future__ import annotations

import pytest

from pamsim.controllers.controller import present_reference
from tests.unit.controllers.closed_loop import observe


@pytest.mark.parametrize("period", [0.01, 0.3])
def test_under_constant_acceleration_it_is_exact(period):
    def motion(t):
        return 0.2 + 0.7 * t - 1.5 * t * t, 0.7 - 3.0 * t, -3.0

    angle, rate, _ = motion(0.4)
    assert present_reference(observe(wanted=motion(0.4 + period)).joint, period) == pytest.approx(
        (angle, rate)
    )
