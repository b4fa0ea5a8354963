"""Shares of control values in a curve: those of the kernel's splines, and of scipy's."""

import numpy as np
import pytest

from pamsim.physics.spline import curve_of_8, shares
from tests.unit.physics.splines import by_scipy

RNG = np.random.default_rng(6)


@pytest.mark.parametrize("count", [8, 24])
def test_a_curve_is_the_sum_of_its_control_values_by_their_shares(count):
    control, x = RNG.normal(size=count), np.linspace(-0.2, 0.3, 41)
    of_each = shares(x, -0.2, 0.3, count)
    assert of_each @ control == pytest.approx(by_scipy(control, (-0.2, 0.3), x), abs=1e-12)
    assert of_each.sum(axis=1) == pytest.approx(1.0)
    (beyond,) = shares(np.array([9.0]), -0.2, 0.3, count)
    assert beyond @ control == pytest.approx(control[-1])


def test_the_kernel_has_the_same_curve():
    control = RNG.normal(size=8)
    for x in (-0.9, -0.2, -0.11, 0.0, 0.123, 0.3, 0.9):
        (of_each,) = shares(np.array([x]), -0.2, 0.3, 8)
        assert curve_of_8(x, -0.2, 0.3, *control) == pytest.approx(of_each @ control, abs=1e-12)
