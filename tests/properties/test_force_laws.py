"""What holds for every force law of the catalog."""

from __future__ import annotations

import inspect
import math
import re
from dataclasses import dataclass

import numba
import numpy as np
import pytest
from hypothesis import assume, given
from numba.extending import register_jitable

from pamsim.core.parameters import ParameterGroup, specs
from pamsim.core.units import to_si
from pamsim.engine.compiled import reached_functions
from pamsim.muscles.braid import Braid, volume
from pamsim.muscles.catalog import FORCE_LAWS
from pamsim.muscles.corrected_mckibben import CorrectedMcKibben
from pamsim.muscles.elastic_energy import ElasticEnergy
from pamsim.muscles.exponential import isobar
from pamsim.muscles.force_law import ForceLaw, coefficients_of
from pamsim.muscles.invertible_exponential import InvertibleExponential
from pamsim.muscles.mckibben import IdealMcKibben
from pamsim.muscles.mooney_rivlin import MooneyRivlin
from pamsim.muscles.pleated_fit import SLENDERNESS_6
from pamsim.muscles.pleated_shape import PleatedShape
from pamsim.muscles.published import PUBLISHED

from .strategies import SHARES, between

BRAID = Braid(nominal_length=0.3, diameter=0.02, fibre_angle=math.radians(28.6))


def scaled(group: ParameterGroup) -> tuple[float, ...]:
    """Coefficients with a scale that is not 1, so that a forgotten scale is seen."""
    return (1.3, *coefficients_of(group)[1:])


EXAMPLES = {
    "ideal_mckibben": scaled(IdealMcKibben()),
    "six_parameter": scaled(PUBLISHED["DMSP-20-200"]),
    "corrected_mckibben": scaled(
        CorrectedMcKibben(a_eps=15.53, b_eps=-1.2386, a_kappa=0.3788, b_kappa=-1.1877)
    ),
    "single_pressure_exponential": scaled(isobar(PUBLISHED["DMSP-20-200"], 3e5)),
    "invertible_exponential": scaled(
        InvertibleExponential(a=7.9e-5, b=419.9, c=-50.9, e=-8.9e-3, f=159.0, g=2.7e-3, h=-327.5)
    ),
    "elastic_energy": scaled(ElasticEnergy(working_pressure=3e5, working_contraction=0.1)),
    "pleated": scaled(SLENDERNESS_6),
    "pleated_shape": scaled(PleatedShape(slenderness=6.0)),
    "mooney_rivlin": scaled(
        MooneyRivlin(c1=-150.0, c2=360.0, slack_contraction=0.002, active_share=0.95)
    ),
}
LAWS = pytest.mark.parametrize("name", FORCE_LAWS)
PRESSURES = between(2e5, 6e5)
LINEAR = set(FORCE_LAWS) - {"corrected_mckibben", "single_pressure_exponential"}


@dataclass(frozen=True)
class Case:
    """A law with coefficients, and contractions in the range it vouches for."""

    law: ForceLaw
    coefficients: tuple[float, ...]

    def contraction(self, share: float) -> float:
        low, high = self.law.contraction_range(self.coefficients, BRAID)
        return low + share * (high - low)

    def rest(self) -> tuple[float, ...]:
        """What the scalar functions take after pressure and contraction."""
        braid = (getattr(BRAID, field) for field in self.law.braid_fields)
        return (*self.coefficients[1:], *braid)


def case(name: str) -> Case:
    return Case(FORCE_LAWS[name], EXAMPLES[name])


def derivative(function, x: float, h: float) -> float:
    """Central differences of eighth order."""
    weights = (4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0)
    return (
        sum(w * (function(x + i * h) - function(x - i * h)) for i, w in enumerate(weights, 1)) / h
    )


@LAWS
@given(pressure=PRESSURES, share=SHARES)
def test_derivative_by_pressure(name, pressure, share):
    this = case(name)
    kappa = this.contraction(share)
    wanted = derivative(lambda p: this.law.force(p, kappa, this.coefficients, BRAID), pressure, 4e3)
    got = this.law.force_dp(pressure, kappa, this.coefficients, BRAID)
    # 1e-3 N/Pa is the size of dF/dp of these muscles.
    assert got == pytest.approx(wanted, rel=1e-8, abs=1e-11)


@LAWS
@given(pressure=PRESSURES, share=SHARES)
def test_derivative_by_contraction(name, pressure, share):
    this = case(name)
    kappa = this.contraction(share)
    wanted = derivative(
        lambda k: this.law.force(pressure, k, this.coefficients, BRAID), kappa, 8e-4
    )
    got = this.law.force_dkappa(pressure, kappa, this.coefficients, BRAID)
    assert got == pytest.approx(wanted, rel=1e-8, abs=1e-5)  # of some 1e4 N


@LAWS
@given(pressure=PRESSURES, share=SHARES)
def test_inverse_gives_the_pressure_back(name, pressure, share):
    this = case(name)
    inverse = this.law.inverse
    if inverse is None:
        assert this.law.pressure_function is None
        return
    # At the largest contraction the force does not depend on pressure, or hardly.
    kappa = this.contraction(0.98 * share)
    force = this.law.force(pressure, kappa, this.coefficients, BRAID)
    if name == "corrected_mckibben":
        # Unique above the threshold, which is the pressure of no force.
        assume(pressure > inverse(0.0, kappa, this.coefficients, BRAID))
    got = inverse(force, kappa, this.coefficients, BRAID)
    assert got == pytest.approx(pressure, rel=1e-9)
    assert this.law.force(got, kappa, this.coefficients, BRAID) == pytest.approx(force, rel=1e-9)


def test_only_the_single_pressure_law_has_no_inverse():
    without = [name for name, law in FORCE_LAWS.items() if law.inverse is None]
    assert without == ["single_pressure_exponential"]


@given(pressure=PRESSURES, share=SHARES)
def test_ideal_force_is_the_work_of_the_air(pressure, share):
    """The volume is a cubic of length, for which the differences are exact."""
    this = case("ideal_mckibben")
    kappa = this.contraction(share)
    geometry = (BRAID.nominal_length, BRAID.diameter, BRAID.fibre_angle)
    slope = derivative(
        lambda length: volume(length, *geometry), BRAID.nominal_length * (1.0 - kappa), 3e-3
    )
    force = this.law.force(pressure, kappa, this.coefficients, BRAID)
    full = this.law.force(pressure, 0.0, this.coefficients, BRAID)
    assert force == pytest.approx(-1.3 * pressure * slope, abs=1e-9 * full)


def scalars(law: ForceLaw) -> list:
    functions = [law.force_function, law.dp_function, law.dkappa_function, law.pressure_function]
    return [function for function in functions if function is not None]


@LAWS
def test_the_scalar_functions_compile_and_give_the_same_numbers(name):
    this = case(name)
    kappa = this.contraction(0.4)
    for function in scalars(this.law):
        plain = inspect.unwrap(function)
        rest = this.rest()
        # The ideal law takes lengths, as the kernel calls it.
        second = kappa if plain is function else BRAID.nominal_length * (1.0 - kappa)
        for reached in reached_functions(plain):
            register_jitable(reached)
        compiled = numba.njit(plain, error_model="numpy")
        for first in (3.7e5, 0.0, math.nan):
            wanted = plain(first, second, *rest)
            assert compiled(first, second, *rest) == pytest.approx(wanted, rel=1e-12, nan_ok=True)
        wanted = plain(3.7e5, math.nan, *rest)
        assert np.isnan(compiled(3.7e5, math.nan, *rest)) == math.isnan(wanted)


def test_names_of_compiled_functions_are_unique_among_the_laws():
    """The compiler finds functions by their bare name: two of one name would hide each other."""
    seen: dict[str, str] = {}
    for law in FORCE_LAWS.values():
        for function in scalars(law):
            for reached in reached_functions(inspect.unwrap(function)):
                assert seen.setdefault(reached.__qualname__, reached.__module__) == (
                    reached.__module__
                )


@LAWS
def test_nan_is_passed_on(name):
    this = case(name)
    kappa = this.contraction(0.4)
    law, coefficients = this.law, this.coefficients
    for pressure, contraction in ((math.nan, kappa), (3e5, math.nan), (math.nan, math.nan)):
        assert math.isnan(law.force(pressure, contraction, coefficients, BRAID))
        assert math.isnan(law.force_dkappa(pressure, contraction, coefficients, BRAID))
        if law.inverse is not None:
            assert math.isnan(law.inverse(pressure, contraction, coefficients, BRAID))
    assert math.isnan(law.force_dp(3e5, math.nan, coefficients, BRAID))
    # A force linear in pressure has a slope that no pressure enters.
    lost = math.isnan(law.force_dp(math.nan, kappa, coefficients, BRAID))
    assert lost == (name not in LINEAR)
    for i in range(len(coefficients)):
        spoilt = (*coefficients[:i], math.nan, *coefficients[i + 1 :])
        assert math.isnan(law.force(3e5, kappa, spoilt, BRAID))


@LAWS
def test_every_law_says_what_it_is(name):
    law = FORCE_LAWS[name]
    assert law.name == law.group.law == name
    assert law.group.group == "force"
    assert law.title
    assert "=" in law.equation
    assert law.notes
    assert re.search(r"Sarosi, equation|\d{4}", law.source)  # an equation, or a year
    fields = list(specs(law.group))
    assert fields[0][0] == "scale"
    assert law.group.__dataclass_fields__["scale"].default == 1.0
    assert len(fields) == len(EXAMPLES[name])
    for _, spec in fields:
        assert spec.doc
        assert to_si(1.0, spec.unit, spec.unit, where="test") == 1.0
    assert law.needs_braid == bool(law.braid_fields)
    for function in (law.force_function, law.dp_function, law.dkappa_function):
        assert inspect.getdoc(function)


@LAWS
def test_scalar_functions_take_the_fields_in_declared_order(name):
    """The order the kernel reads them from the row: any other would compile and be wrong."""
    law = FORCE_LAWS[name]
    fields = [field for field, _ in specs(law.group)][1:]
    for function in scalars(law):
        names = list(inspect.signature(inspect.unwrap(function)).parameters)
        second = "contraction" if inspect.unwrap(function) is function else "length"
        first = "force" if function is law.pressure_function else "pressure"
        assert names == [first, second, *fields, *law.braid_fields]


@LAWS
def test_range_of_contraction_is_one_in_which_the_muscle_pulls(name):
    this = case(name)
    low, high = this.law.contraction_range(this.coefficients, BRAID)
    assert 0.0 <= low < high < 0.6
    pressure = 6e5 if this.law.pressure_range is None else min(this.law.pressure_range[1], 6e5)
    if name == "elastic_energy":  # counts from its working point, and is zero there
        assert this.law.force(3e5, 0.1, this.coefficients, BRAID) == 0.0
        return
    forces = [
        this.law.force(pressure, kappa, this.coefficients, BRAID)
        for kappa in np.linspace(low, high, 30)
    ]
    assert np.all(np.diff(forces) < 0.0)
    assert forces[0] > 0.0


def test_the_catalog_cannot_be_changed():
    with pytest.raises(TypeError):
        FORCE_LAWS["mine"] = FORCE_LAWS["pleated"]
