"""The learned curves: splines of their control forces that stay at their ends."""

import numpy as np
import pytest

from pamsim.physics.learned import LENGTH, SPEED, Learned, learned_force, learns
from tests.unit.physics.splines import by_scipy

RNG = np.random.default_rng(4)
FORCES, DRAGS = RNG.normal(size=LENGTH) * 20.0, RNG.normal(size=SPEED) * 5.0


def curves(forces=FORCES, drags=DRAGS):
    numbers = {f"force_{k}": float(c) for k, c in enumerate(forces, start=1)}
    numbers |= {f"drag_{k}": float(c) for k, c in enumerate(drags, start=1)}
    return Learned(low=0.16, high=0.2, slowest=-0.1, fastest=0.15, **numbers)


def test_each_curve_is_scipy_s_spline_and_stays_at_its_ends():
    """There it has the outermost control force, by scipy's spline with no curvature."""
    for x in np.linspace(0.16, 0.2, 23):
        alone = learned_force(curves(drags=np.zeros(SPEED)), float(x), 0.3)
        assert alone == pytest.approx(by_scipy(FORCES, (0.16, 0.2), x), abs=1e-9)
    for v in np.linspace(-0.1, 0.15, 23):
        alone = learned_force(curves(forces=np.zeros(LENGTH)), 0.17, float(v))
        assert alone == pytest.approx(by_scipy(DRAGS, (-0.1, 0.15), v), abs=1e-9)
    assert learned_force(curves(), 0.0, 9.0) == pytest.approx(FORCES[0] + DRAGS[-1])
    assert learned_force(curves(), 0.3, -9.0) == pytest.approx(FORCES[-1] + DRAGS[0])


def test_without_ends_there_is_no_curve():
    assert not learns(Learned())
    assert learned_force(Learned(force_3=10.0, drag_3=10.0), 0.18, 0.1) == 0.0
    assert learns(Learned(low=0.1, high=0.2))
    assert learns(Learned(slowest=-0.1, fastest=0.1))
