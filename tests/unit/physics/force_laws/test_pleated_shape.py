"""The exact shape of a pleated muscle against its own mechanics, integrated numerically."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

from pamsim.physics.force_laws.pleated import (
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


def bulge_of(contraction: float, slenderness: float) -> float:
    """Radius at the equator over the radius of the ends, r_m/R = 1 / cos(a)."""
    return 1.0 / math.cos(end_amplitude(shape_parameter(contraction, slenderness), slenderness))


def meridian(function: float, bulge: float, slenderness: float) -> tuple[float, float, float]:
    """Walk half a meridian from the equator by the balance of forces alone, in units of R.

    The angle follows from T cos(phi) = F + pi p r^2 in its differentiated form,
    d(phi)/ds = 2 pi p r / T, with p = 1; nothing of the closed solution enters but the force and
    the radius to start from.

    Returns:
        Contraction, radius at the end of the meridian [R], volume [l0^3].
    """
    force = function * slenderness**2
    tension = force + math.pi * bulge**2

    def rates(_, y):
        r, phi, _, _ = y
        along = math.cos(phi)
        return [
            -math.sin(phi),
            2.0 * math.pi * r / tension,
            along,
            math.pi * r**2 * along,
        ]

    walk = solve_ivp(
        rates, (0.0, slenderness / 2.0), [bulge, 0.0, 0.0, 0.0], rtol=1e-11, atol=1e-12
    )
    radius, _, height, volume = walk.y[:, -1]
    return 1.0 - 2.0 * height / slenderness, radius, 2.0 * volume / slenderness**3


@pytest.mark.parametrize(("slenderness", "eps"), SHAPES)
def test_shape_is_in_balance_everywhere(slenderness, eps):
    function = pleated_shape_function(eps, slenderness)
    bulge = bulge_of(eps, slenderness)
    contraction, radius, _ = meridian(function, bulge, slenderness)
    assert contraction == pytest.approx(eps, rel=1e-8)
    assert radius == pytest.approx(1.0, rel=1e-8)


@pytest.mark.parametrize(("slenderness", "eps"), SHAPES)
def test_force_is_the_work_of_the_air(slenderness, eps):
    """F = -p dV/dl, the volume integrated along the meridian."""

    def volume(contraction):
        return meridian(
            pleated_shape_function(contraction, slenderness),
            bulge_of(contraction, slenderness),
            slenderness,
        )[2]

    h = 0.01 * eps
    slope = 8.0 * (volume(eps + h) - volume(eps - h)) - volume(eps + 2 * h) + volume(eps - 2 * h)
    start = abs(pleated_shape_function(0.1 * eps, slenderness))
    assert slope / (12.0 * h) == pytest.approx(
        pleated_shape_function(eps, slenderness), rel=1e-6, abs=1e-7 * start
    )


@pytest.mark.parametrize(("slenderness", "eps"), SHAPES)
def test_same_solution_with_library_integrals(slenderness, eps):
    def amplitude(m):
        return brentq(
            lambda a: ellipkinc(a, m) - slenderness * math.sqrt(m) * math.cos(a),
            0.0,
            math.pi / 2.0,
            xtol=1e-15,
        )

    def miss(m):
        a = amplitude(m)
        return 2.0 * (1.0 - ellipeinc(a, m) / ellipkinc(a, m)) - eps

    m = brentq(miss, 1e-9, 1.0 - 1e-9, xtol=1e-15)
    assert shape_parameter(eps, slenderness) == pytest.approx(m, rel=1e-11)
    assert end_amplitude(m, slenderness) == pytest.approx(amplitude(m), rel=1e-12)
    function = math.pi * (1.0 - 2.0 * m) / (2.0 * ellipkinc(amplitude(m), m) ** 2)
    assert pleated_shape_function(eps, slenderness) == pytest.approx(function, rel=1e-10)


@pytest.mark.parametrize("slenderness", [0.5, 2.0, 6.0, 100.0])
def test_contraction_grows_with_the_shape_parameter(slenderness):
    """What makes the solution unique."""
    m = np.linspace(1e-4, 0.98, 300)
    a = np.array([end_amplitude(each, slenderness) for each in m])
    assert np.all(np.diff(2.0 * (1.0 - ellipeinc(a, m) / ellipkinc(a, m))) > 0.0)


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


@pytest.mark.parametrize("slenderness", [1.0, 6.0, 30.0])
def test_force_at_small_contraction_grows_as_one_over_its_root(slenderness):
    """Not as 1/eps, the leading term of equation (2)."""
    eps = 1e-8 / slenderness**2
    limit = math.pi / (slenderness * math.sqrt(6.0 * eps))
    assert pleated_shape_function(eps, slenderness) == pytest.approx(limit, rel=1e-3)


def test_published_size_of_the_force():
    """Van Damme 2008 drives its muscle (l0 = 6 cm, at most 2.5 bar) up to 2150 N at eps > 5 %."""
    at_five_percent = pleated_shape_force(2.5e5, 0.05, 6.0, 0.06)
    assert 1000.0 < at_five_percent < 2150.0
    assert pleated_shape_force(2.5e5, 0.02, 6.0, 0.06) > at_five_percent


@pytest.mark.parametrize("eps", [0.0, -0.1, math.nan, 0.99, 3.0])
def test_no_shape_no_force(eps):
    assert math.isnan(pleated_shape_function(eps, 6.0))
    assert math.isnan(pleated_shape_force(1e5, eps, 6.0, 0.06))


@pytest.mark.parametrize("slenderness", [0.0, -6.0, math.nan])
def test_no_shape_without_a_slenderness(slenderness):
    assert math.isnan(shape_parameter(0.1, slenderness))


def test_a_stout_muscle_has_no_shape_at_large_contraction():
    assert math.isnan(shape_parameter(1.5, 0.1))
    assert math.isnan(shape_parameter(100.0, 0.1))


@pytest.mark.parametrize("slenderness", [0.2, 1.0, 6.0, 50.0, 1000.0])
def test_every_contraction_up_to_the_largest_has_a_shape(slenderness):
    largest = pleated_max_contraction(slenderness)
    for eps in np.geomspace(1e-9, largest, 60):
        m = shape_parameter(float(eps), slenderness)
        a = end_amplitude(m, slenderness)
        assert math.cos(a) * slenderness * math.sqrt(m) == pytest.approx(ellipkinc(a, m), rel=1e-9)
        assert 0.0 < m < 0.5 + 1e-9
