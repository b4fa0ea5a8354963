"""The exponential laws are one family: eight printed constants, seven, six, and one isobar."""

from __future__ import annotations

import math

import pytest

from pamsim.core.errors import ParameterError
from pamsim.muscles.exponential import (
    isobar,
    six_parameter_force,
    six_parameter_pressure,
)
from pamsim.muscles.force_law import coefficients_of
from pamsim.muscles.invertible_exponential import (
    InvertibleExponential,
    invertible_exponential_force,
    invertible_exponential_pressure,
)
from pamsim.muscles.published import PUBLISHED
from pamsim.muscles.single_pressure_exponential import folded_factor, single_pressure_force

EIGHT = {
    "a": 7e-5, "b": 420.0, "c": -51.0, "d": 0.4, "e": -8.9e-3, "f": 159.0, "g": 2.7e-3, "h": -327.0
}  # fmt: skip
POINTS = [(p, k) for p in (0.0, 1e5, 4.3e5) for k in (-0.03, 0.0, 0.08, 0.25)]


def printed_force(p, k, a, b, c, d, e, f, g, h):
    return (a * p + b) * math.exp(c * k + d) + (e * p + f) * k + g * p + h


def printed_inverse(y, k, a, b, c, d, e, f, g, h):
    grown = math.exp(c * k + d)
    return -(-y + b * grown + k * f + h) / (a * grown + k * e + g)


@pytest.mark.parametrize(("p", "k"), POINTS)
def test_seven_constants_give_the_forces_of_the_eight_printed(p, k):
    law = coefficients_of(InvertibleExponential.from_paper(**EIGHT))[1:]
    wanted = printed_force(p, k, **EIGHT)
    assert invertible_exponential_force(p, k, *law) == pytest.approx(wanted, rel=1e-12, abs=1e-9)
    pressure = invertible_exponential_pressure(200.0, k, *law)
    assert pressure == pytest.approx(printed_inverse(200.0, k, **EIGHT), rel=1e-12)


def test_the_eighth_constant_cannot_be_told_from_a_and_b():
    other = {**EIGHT, "d": 0.0, "a": EIGHT["a"] * math.exp(0.4), "b": EIGHT["b"] * math.exp(0.4)}
    first = coefficients_of(InvertibleExponential.from_paper(**EIGHT))
    second = coefficients_of(InvertibleExponential.from_paper(**other))
    assert first == pytest.approx(second, rel=1e-15, abs=0.0)


def test_folding_out_of_range_is_said():
    with pytest.raises(ParameterError, match=r"force\.a = "):
        InvertibleExponential.from_paper(**{**EIGHT, "d": 20.0})


@pytest.mark.parametrize("name", PUBLISHED)
@pytest.mark.parametrize(("p", "k"), POINTS)
def test_six_parameters_are_seven_without_the_linear_elasticity(name, p, k):
    six = PUBLISHED[name]
    seven = InvertibleExponential.from_six_parameter(six)
    assert seven.f == 0.0
    assert invertible_exponential_force(p, k, *coefficients_of(seven)[1:]) == six_parameter_force(
        p, k, *coefficients_of(six)[1:]
    )


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
        force = single_pressure_force(3e5, k, folded_factor(a, c), b, d, e)
        assert force == pytest.approx(wanted, rel=1e-13)


def test_no_inverse_where_pressure_has_no_effect():
    assert math.isnan(six_parameter_pressure(10.0, 0.5, 0.0, 1.0, -1.0, -2.0, 1.0, 0.0))
