"""The exact shape of a pleated muscle against its own mechanics, integrated numerically."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc, elliprd, elliprf

from pamsim.physics.force_laws.pleated import (
    carlson_integrals,
    elliptic_integrals,
    end_amplitude,
    pleated_max_contraction,
    pleated_shape_force,
    pleated_shape_function,
    shape_parameter,
)

SHAPES = [
    (slenderness, share * pleated_max_contraction(slenderness))
    for slenderness in (1.0, 6.0, 30.0)
    for share in (0.1, 0.5, 0.95, 1.05)
]


def meridian(eps: float, slenderness: float) -> tuple[float, float, float]:
    """Walk half a meridian from the equator by the balance of forces alone, in units of R.

    The angle follows from T cos(phi) = F + pi p r^2 in its differentiated form,
    d(phi)/ds = 2 pi p r / T, with p = 1; nothing of the closed solution enters but the force and
    the radius to start from.

    Returns:
        Contraction, radius at the end of the meridian [R], volume [l0^3].
    """
    # Radius at the equator over that of the ends, r_m/R = 1 / cos(a).
    bulge = 1.0 / math.cos(end_amplitude(shape_parameter(eps, slenderness), slenderness))
    force = pleated_shape_function(eps, slenderness) * slenderness**2
    tension = force + math.pi * bulge**2

    def rates(_, y):
        r, phi, _, _ = y
        along = math.cos(phi)
        return [-math.sin(phi), 2.0 * math.pi * r / tension, along, math.pi * r**2 * along]

    span, start = (0.0, slenderness / 2.0), [bulge, 0.0, 0.0, 0.0]
    walk = solve_ivp(rates, span, start, rtol=1e-11, atol=1e-12)
    radius, _, height, volume = walk.y[:, -1]
    return 1.0 - 2.0 * height / slenderness, radius, 2.0 * volume / slenderness**3


@pytest.mark.parametrize(("slenderness", "eps"), SHAPES)
def test_shape_is_in_balance_everywhere_and_force_is_the_work_of_the_air(slenderness, eps):
    """F = -p dV/dl, the volume integrated along the meridian."""
    contraction, radius, _ = meridian(eps, slenderness)
    assert contraction == pytest.approx(eps, rel=1e-8)
    assert radius == pytest.approx(1.0, rel=1e-8)
    h = 0.01 * eps
    near, far = (
        meridian(eps + k * h, slenderness)[2] - meridian(eps - k * h, slenderness)[2]
        for k in (1, 2)
    )
    start = abs(pleated_shape_function(0.1 * eps, slenderness))
    assert (8.0 * near - far) / (12.0 * h) == pytest.approx(
        pleated_shape_function(eps, slenderness), rel=1e-6, abs=1e-7 * start
    )


def test_largest_contraction():
    """Over 40 % for the slenderness of Van Damme 2008, and at most 54.3 %."""
    assert pleated_max_contraction(6.0) == pytest.approx(0.40252, abs=1e-5)
    limit = 2.0 * (1.0 - ellipe(0.5) / ellipk(0.5))
    assert pleated_max_contraction(1e6) == pytest.approx(limit, abs=1e-5)
    assert limit == pytest.approx(0.543, abs=5e-4)
    for slenderness in (1.0, 6.0, 100.0):
        largest = pleated_max_contraction(slenderness)
        assert pleated_shape_function(largest, slenderness) == pytest.approx(0.0, abs=1e-11)
        assert pleated_shape_function(0.999 * largest, slenderness) > 0.0
        assert pleated_shape_function(1.001 * largest, slenderness) < 0.0


def test_where_there_is_no_shape_there_is_no_force_and_up_to_the_largest_contraction_there_is():
    for eps in (0.0, -0.1, math.nan, 0.99, 3.0):
        assert math.isnan(pleated_shape_function(eps, 6.0))
        assert math.isnan(pleated_shape_force(1e5, eps, 6.0, 0.06))
    for slenderness in (0.0, -6.0, math.nan):
        assert math.isnan(shape_parameter(0.1, slenderness))
    for eps in (1.5, 100.0):  # a stout muscle
        assert math.isnan(shape_parameter(eps, 0.1))
    for slenderness in (0.2, 1.0, 6.0, 50.0, 1000.0):
        largest = pleated_max_contraction(slenderness)
        for eps in np.geomspace(1e-9, largest, 60).tolist():
            m = shape_parameter(eps, slenderness)
            a = end_amplitude(m, slenderness)
            assert math.cos(a) * slenderness * math.sqrt(m) == pytest.approx(
                ellipkinc(a, m), rel=1e-9
            )
            assert 0.0 < m < 0.5 + 1e-9


# --- elliptic integrals --------------------------------------------------------------------------

ARGUMENTS = [0.0, 1e-300, 1e-9, 0.03, 0.5, 1.0, 7.0, 1e6]
SPREADS = np.random.default_rng(7).uniform(-8.0, 8.0, (3000, 3))
"""The series at the end of the duplication must be good at the largest spread it is left."""
NO_STEP = [(1.0029, 0.9985, 0.9985), (0.9971, 1.0015, 1.0015), (0.9979, 0.9979, 1.0014)]
"""Just below the spread that needs a step: there the series stands alone."""


def test_elliptic_integrals_are_scipy_s():
    grid = itertools.product(ARGUMENTS, ARGUMENTS[1:], [0.2, 1.0, 30.0])
    cases = np.array([*grid, *np.exp(SPREADS), *NO_STEP])
    first, second = zip(*(carlson_integrals(*case) for case in cases.tolist()), strict=True)
    x, y, z = cases.T
    assert first == pytest.approx(elliprf(x, y, z), rel=3e-15, abs=0.0)
    assert second == pytest.approx(elliprd(x, y, z), rel=3e-15, abs=0.0)
    assert all(map(math.isnan, carlson_integrals(math.nan, 1.0, 1.0)))  # the loops end
    amplitudes = (1e-6, 1e-3, 0.1, 0.7, 1.4, 1.57, math.pi / 2.0)
    for a, m in itertools.product(amplitudes, (0.0, 1e-8, 1e-3, 0.1, 0.5, 0.9, 0.999)):
        whole, part = elliptic_integrals(a, m)
        assert whole == pytest.approx(ellipkinc(a, m), rel=3e-15, abs=0.0)
        assert whole - m * part == pytest.approx(ellipeinc(a, m), rel=3e-15, abs=0.0)


def test_the_difference_of_first_and_second_kind_keeps_its_digits():
    """(F - E) / m by subtraction has lost half of them at m = 1e-8."""
    nodes, weights = np.polynomial.legendre.leggauss(40)
    t = 0.5 * 0.7 * (nodes + 1.0)
    part = 0.5 * 0.7 * np.sum(weights * np.sin(t) ** 2 / np.sqrt(1.0 - 1e-8 * np.sin(t) ** 2))
    assert elliptic_integrals(0.7, 1e-8)[1] == pytest.approx(part, rel=1e-14, abs=0.0)
