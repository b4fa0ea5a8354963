"""Scalar elliptic integrals against scipy's."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import ellipeinc, ellipkinc, elliprd, elliprf

from pamsim.physics.force_laws.elliptic import (
    carlson_rd,
    carlson_rf,
    elliptic_integrals,
    first_elliptic_integral,
)

ARGUMENTS = [0.0, 1e-300, 1e-9, 0.03, 0.5, 1.0, 7.0, 1e6]


@pytest.mark.parametrize("x", ARGUMENTS)
@pytest.mark.parametrize("y", ARGUMENTS[1:])
@pytest.mark.parametrize("z", [0.2, 1.0, 30.0])
def test_symmetric_integrals(x, y, z):
    assert carlson_rf(x, y, z) == pytest.approx(elliprf(x, y, z), rel=2e-15, abs=0.0)
    assert carlson_rd(x, y, z) == pytest.approx(elliprd(x, y, z), rel=2e-15, abs=0.0)


def test_symmetric_integrals_at_any_spread():
    """The series at the end of the duplication must be good at the largest spread it is left."""
    x, y, z = np.exp(np.random.default_rng(7).uniform(-8.0, 8.0, (3, 3000)))
    first = [carlson_rf(*each) for each in zip(x, y, z, strict=True)]
    second = [carlson_rd(*each) for each in zip(x, y, z, strict=True)]
    assert first == pytest.approx(elliprf(x, y, z), rel=3e-15, abs=0.0)
    assert second == pytest.approx(elliprd(x, y, z), rel=3e-15, abs=0.0)


@pytest.mark.parametrize(
    ("x", "y", "z"), [(1.00395, 0.998, 0.998), (0.99605, 1.002, 1.002), (0.9971, 0.9971, 1.00193)]
)
def test_series_alone_just_below_the_spread_that_needs_a_step(x, y, z):
    assert carlson_rf(x, y, z) == pytest.approx(elliprf(x, y, z), rel=2e-15, abs=0.0)
    assert carlson_rd(x, y, z) == pytest.approx(elliprd(x, y, z), rel=2e-15, abs=0.0)


@pytest.mark.parametrize("m", [0.0, 1e-8, 1e-3, 0.1, 0.5, 0.9, 0.999])
@pytest.mark.parametrize("a", [1e-6, 1e-3, 0.1, 0.7, 1.4, 1.57, math.pi / 2.0])
def test_legendre_integrals(a, m):
    first, part = elliptic_integrals(a, m)
    assert first == first_elliptic_integral(a, m)
    assert first == pytest.approx(ellipkinc(a, m), rel=3e-15, abs=0.0)
    assert first - m * part == pytest.approx(ellipeinc(a, m), rel=3e-15, abs=0.0)


def test_the_difference_of_first_and_second_kind_keeps_its_digits():
    """(F - E) / m by subtraction has lost half of them at m = 1e-8."""
    nodes, weights = np.polynomial.legendre.leggauss(40)
    t = 0.5 * 0.7 * (nodes + 1.0)
    part = 0.5 * 0.7 * np.sum(weights * np.sin(t) ** 2 / np.sqrt(1.0 - 1e-8 * np.sin(t) ** 2))
    assert elliptic_integrals(0.7, 1e-8)[1] == pytest.approx(part, rel=1e-14, abs=0.0)


def test_nan_ends_the_loops_and_stays():
    assert math.isnan(carlson_rf(math.nan, 1.0, 1.0))
    assert math.isnan(carlson_rd(math.nan, 1.0, 1.0))
