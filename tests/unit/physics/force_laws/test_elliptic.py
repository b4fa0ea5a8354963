"""Scalar elliptic integrals against scipy's."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.special import ellipeinc, ellipkinc, elliprd, elliprf

from pamsim.physics.force_laws.pleated import carlson_integrals, elliptic_integrals

ARGUMENTS = [0.0, 1e-300, 1e-9, 0.03, 0.5, 1.0, 7.0, 1e6]
SPREADS = np.random.default_rng(7).uniform(-8.0, 8.0, (3000, 3))
"""The series at the end of the duplication must be good at the largest spread it is left."""
NO_STEP = [(1.0029, 0.9985, 0.9985), (0.9971, 1.0015, 1.0015), (0.9979, 0.9979, 1.0014)]
"""Just below the spread that needs a step: there the series stands alone."""


def test_symmetric_integrals():
    grid = itertools.product(ARGUMENTS, ARGUMENTS[1:], [0.2, 1.0, 30.0])
    cases = np.array([*grid, *np.exp(SPREADS), *NO_STEP])
    first, second = zip(*(carlson_integrals(*case) for case in cases.tolist()), strict=True)
    x, y, z = cases.T
    assert first == pytest.approx(elliprf(x, y, z), rel=3e-15, abs=0.0)
    assert second == pytest.approx(elliprd(x, y, z), rel=3e-15, abs=0.0)


@pytest.mark.parametrize("m", [0.0, 1e-8, 1e-3, 0.1, 0.5, 0.9, 0.999])
@pytest.mark.parametrize("a", [1e-6, 1e-3, 0.1, 0.7, 1.4, 1.57, math.pi / 2.0])
def test_legendre_integrals(a, m):
    first, part = elliptic_integrals(a, m)
    assert first == pytest.approx(ellipkinc(a, m), rel=3e-15, abs=0.0)
    assert first - m * part == pytest.approx(ellipeinc(a, m), rel=3e-15, abs=0.0)


def test_the_difference_of_first_and_second_kind_keeps_its_digits():
    """(F - E) / m by subtraction has lost half of them at m = 1e-8."""
    nodes, weights = np.polynomial.legendre.leggauss(40)
    t = 0.5 * 0.7 * (nodes + 1.0)
    part = 0.5 * 0.7 * np.sum(weights * np.sin(t) ** 2 / np.sqrt(1.0 - 1e-8 * np.sin(t) ** 2))
    assert elliptic_integrals(0.7, 1e-8)[1] == pytest.approx(part, rel=1e-14, abs=0.0)


def test_nan_ends_the_loops_and_stays():
    assert all(map(math.isnan, carlson_integrals(math.nan, 1.0, 1.0)))
