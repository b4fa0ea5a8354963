"""The polynomial force function of a pleated muscle."""

from __future__ import annotations

import math

import pytest

from pamsim.physics.force_laws.force_law import coefficients_of
from pamsim.physics.force_laws.pleated import (
    SLENDERNESS_6,
    pleated_force,
    pleated_function,
    pleated_shape_force,
)

SIX = coefficients_of(SLENDERNESS_6)[1:]


def test_is_the_printed_equation():
    f = (0.02, 1.1, -4.7, 6.9, -5.2)
    for eps in (0.05, 0.2, 0.4):
        wanted = 2e5 * 0.06**2 * (f[0] / eps + f[1] + f[2] * eps + f[3] * eps**2 + f[4] * eps**3)
        assert pleated_force(2e5, eps, *f, 0.06) == pytest.approx(wanted, rel=1e-13)


def test_below_five_percent_the_polynomial_pulls_too_hard():
    """Its 1/eps grows faster than the exact force: 3 % too much at 3 %, 8 % at 2 %."""
    for eps, excess in ((0.03, 0.031), (0.02, 0.084)):
        ratio = pleated_force(1e5, eps, *SIX, 0.06) / pleated_shape_force(1e5, eps, 6.0, 0.06)
        assert ratio - 1.0 == pytest.approx(excess, abs=1e-3)


@pytest.mark.parametrize("eps", [0.0, -0.05, math.nan])
def test_no_force_at_and_below_zero_contraction(eps):
    assert math.isnan(pleated_function(eps, *SIX))
    assert math.isnan(pleated_force(1e5, eps, *SIX, 0.06))
