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

from pamsim.core.parameters import specs
from pamsim.core.units import to_si
from pamsim.engine.jit import hand_to_numba, reached_functions
from pamsim.gpu.port import ladders
from pamsim.gpu.translate import translated_name
from pamsim.physics.braid import Braid, volume
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.effective_area import EffectiveArea
from pamsim.physics.force_laws.force_law import ForceLaw, coefficients_of
from tests.unit.physics.muscles import FORCES

from .strategies import SHARES, between

PUSHING = EffectiveArea(area=4e-4, stiffness=200.0)
BRAID = Braid(nominal_length=0.3, diameter=0.02, fibre_angle=math.radians(28.6))

EXAMPLES = {
    name: (1.3, *coefficients_of(group)[1:])
    for name, group in {**FORCES, "effective_area": PUSHING}.items()
}
"""With a scale that is not 1, so that a forgotten one is seen."""
LAWS = pytest.mark.parametrize("name", FORCE_LAWS)
PRESSURES = between(2e5, 6e5)


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
def test_a_force_has_one_pressure_unless_the_law_holds_at_one_only(name, pressure, share):
    """What `pamsim list models` reports as the inverse."""
    this = case(name)
    # At the largest contraction the force does not depend on pressure, or hardly.
    kappa = this.contraction(0.98 * share)

    def force(at: float) -> float:
        return this.law.force(at, kappa, this.coefficients, BRAID)

    if this.law.pressure_range is None:
        assert name == "single_pressure_exponential"
        assert force(1.01 * pressure) == force(pressure)
        return
    if name == "corrected_mckibben":
        assume(force(pressure) > 0.0)  # above its threshold
    assert (force(1.01 * pressure) > force(pressure)) is not this.law.pushes


@LAWS
@given(pressure=PRESSURES, share=SHARES)
def test_the_force_falls_smoothly_with_contraction(name, pressure, share):
    """Two stencils agree on the slope, and it is negative wherever the muscle pulls."""
    this = case(name)
    kappa = this.contraction(share)

    def force(at: float) -> float:
        return this.law.force(pressure, at, this.coefficients, BRAID)

    slope = derivative(force, kappa, 8e-4)
    assert slope == pytest.approx(derivative(force, kappa, 4e-4), rel=1e-7, abs=1e-4)
    if (force(kappa) > 0.0 or this.law.pushes) and name != "single_pressure_exponential":
        assert slope < 0.0


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


def test_names_of_compiled_functions_are_unique_among_the_laws():
    """Where all laws meet, functions go by their names: two of one name would hide each other."""
    reached = reached_functions(*ladders().values())
    assert {law.force_function for law in FORCE_LAWS.own()} <= set(reached)
    assert len(set(map(translated_name, reached))) == len(reached)


def compiled(function):
    """A law compiled with every function that it calls, as the engine compiles it."""
    *callees, _ = reached_functions(function)
    hand_to_numba(callees)
    return numba.njit(function, error_model="numpy")


@LAWS
def test_the_force_function_compiles_and_gives_the_same_numbers(name):
    this = case(name)
    kappa, plain, rest = this.contraction(0.4), this.law.force_function, this.rest()
    fast = compiled(plain)
    for pressure in (3.7e5, 0.0, math.nan):
        wanted = plain(pressure, kappa, *rest)
        assert fast(pressure, kappa, *rest) == pytest.approx(wanted, rel=1e-12, nan_ok=True)
    wanted = plain(3.7e5, math.nan, *rest)
    assert np.isnan(fast(3.7e5, math.nan, *rest)) == math.isnan(wanted)


@LAWS
@given(pressure=PRESSURES, share=SHARES)
def test_the_air_does_the_work_that_the_muscle_gives(name, pressure, share):
    """dV/dl = -dF/dp: nothing is gained or lost over any closed path of length and pressure."""
    this = case(name)
    kappa = this.contraction(0.02 + 0.96 * share)
    if name == "corrected_mckibben":
        pressure += 100.0  # below 2 bar its volume is that at 2 bar

    def inside(at: float) -> float:
        return this.law.volume(pressure, at, this.coefficients, BRAID)

    def force(at: float) -> float:
        return this.law.force(at, kappa, this.coefficients, BRAID)

    slope = derivative(inside, kappa, 4e-4) / BRAID.nominal_length
    full = abs(this.law.force(6e5, this.contraction(0.02), this.coefficients, BRAID)) / 6e5
    assert slope == pytest.approx(derivative(force, pressure, 20.0), abs=1e-6 * full)


@given(share=SHARES)
def test_the_ideal_law_has_the_braid_s_volume(share):
    braid, law = BRAID, FORCE_LAWS["ideal_mckibben"]
    length = braid.nominal_length * (1.0 - 0.4 * share)
    wanted = volume(length, braid.nominal_length, braid.diameter, braid.fibre_angle)
    found = law.volume(3e5, 0.4 * share, (1.0,), braid)
    assert found == pytest.approx(wanted, rel=1e-12)


@LAWS
def test_the_volume_function_takes_the_same_numbers_and_compiles(name):
    this = case(name)
    function = this.law.volume_function
    given_force = inspect.signature(this.law.force_function).parameters
    assert list(inspect.signature(function).parameters) == list(given_force)
    fast = compiled(function)
    for kappa in (this.contraction(0.4), math.nan):
        wanted = function(3.7e5, kappa, *this.rest())
        assert fast(3.7e5, kappa, *this.rest()) == pytest.approx(wanted, rel=1e-12, nan_ok=True)
        assert math.isnan(wanted) == math.isnan(kappa)


@LAWS
def test_a_card_says_whether_the_volume_depends_on_pressure(name):
    this = case(name)
    law, coefficients = this.law, this.coefficients
    kappa = this.contraction(0.4)
    low, high = (law.volume(p, kappa, coefficients, BRAID) for p in (2.5e5, 5e5))
    assert law.volume_varies == (low != high)


@LAWS
def test_nan_is_passed_on(name):
    this = case(name)
    kappa = this.contraction(0.4)
    law, coefficients = this.law, this.coefficients
    for pressure, contraction in ((math.nan, kappa), (3e5, math.nan), (math.nan, math.nan)):
        assert math.isnan(law.force(pressure, contraction, coefficients, BRAID))
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
    fields = specs(law.group)
    assert fields[0][0] == "scale"
    assert law.group.__dataclass_fields__["scale"].default == 1.0
    assert len(fields) == len(EXAMPLES[name])
    for _, spec in fields:
        assert spec.doc
        assert to_si(1.0, spec.unit, spec.unit, where="test") == 1.0
    assert inspect.getdoc(law.force_function)


@LAWS
def test_the_force_function_takes_the_fields_in_declared_order(name):
    """The order in which they are handed over: any other would compile and be wrong."""
    law = FORCE_LAWS[name]
    fields = [field for field, _ in specs(law.group)][1:]
    names = list(inspect.signature(law.force_function).parameters)
    assert names == ["pressure", "contraction", *fields, *law.braid_fields]


@LAWS
def test_range_of_contraction_is_one_in_which_the_muscle_pulls(name):
    this = case(name)
    low, high = this.law.contraction_range(this.coefficients, BRAID)
    if this.law.pushes:
        assert this.law.force(6e5, low, this.coefficients, BRAID) < 0.0
        return
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
