"""The exponential laws are one family: eight printed constants, seven, six, and one isobar."""

from __future__ import annotations

import math

import pytest

from pamsim.papers.sarosi.equations import isobar
from pamsim.physics.force_laws.exponential import (
    invertible_exponential_force,
    single_pressure_force,
    six_parameter_force,
)
from pamsim.physics.force_laws.force_law import coefficients_of
from pamsim.physics.force_laws.published import PUBLISHED

EIGHT = {
    "a": 7e-5, "b": 420.0, "c": -51.0, "d": 0.4, "e": -8.9e-3, "f": 159.0, "g": 2.7e-3, "h": -327.0
}  # fmt: skip
POINTS = [(p, k) for p in (0.0, 1e5, 4.3e5) for k in (-0.03, 0.0, 0.08, 0.25)]


def printed_force(p, k, a, b, c, d, e, f, g, h):
    return (a * p + b) * math.exp(c * k + d) + (e * p + f) * k + g * p + h


@pytest.mark.parametrize(("p", "k"), POINTS)
def test_seven_constants_give_the_forces_of_the_eight_printed(p, k):
    a, b, c, d, *rest = EIGHT.values()
    law = (a * math.exp(d), b * math.exp(d), c, *rest)
    wanted = printed_force(p, k, **EIGHT)
    assert invertible_exponential_force(p, k, *law) == pytest.approx(wanted, rel=1e-12, abs=1e-9)


@pytest.mark.parametrize("name", PUBLISHED)
@pytest.mark.parametrize(("p", "k"), POINTS)
def test_six_parameters_are_seven_without_the_linear_elasticity(name, p, k):
    a, b, c, d, e, f = coefficients_of(PUBLISHED[name])[1:]
    seven = invertible_exponential_force(p, k, a, b, c, d, 0.0, e, f)
    assert seven == six_parameter_force(p, k, a, b, c, d, e, f)


@pytest.mark.parametrize("name", PUBLISHED)
@pytest.mark.parametrize(("p", "k"), POINTS)
def test_an_isobar_is_the_single_pressure_law(name, p, k):
    six = PUBLISHED[name]
    cut = coefficients_of(isobar(six, p))[1:]
    wanted = six_parameter_force(p, k, *coefficients_of(six)[1:])
    assert single_pressure_force(1.0, k, *cut) == pytest.approx(wanted, rel=1e-12, abs=1e-9)


def test_the_single_pressure_law_is_the_printed_one_with_c_folded():
    a, b, c, d, e = 350.0, -35.0, 0.3, -900.0, 610.0  # Sarosi (3)
    for k in (0.0, 0.05, 0.2):
        wanted = a * math.exp(b * k + c) + d * k + e
        force = single_pressure_force(3e5, k, a * math.exp(c), b, d, e)
        assert force == pytest.approx(wanted, rel=1e-13)
