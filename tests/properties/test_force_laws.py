"""What holds for every force law of the catalog."""

from __future__ import annotations

import math
from dataclasses import dataclass

import pytest
from hypothesis import assume, given

from pamsim.engine.jit import reached_functions
from pamsim.gpu.port import ladders
from pamsim.gpu.translate import translated_name
from pamsim.physics.braid import Braid
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.effective_area import EffectiveArea
from pamsim.physics.force_laws.force_law import ForceLaw, coefficients_of
from tests.unit.physics.muscles import FORCES

from .strategies import SHARES, between

PUSHING = EffectiveArea(area=4e-4, stiffness=200.0)
BRAID = Braid(nominal_length=0.3, diameter=0.02, fibre_angle=math.radians(28.6))
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

    def force(self, pressure: float, contraction: float) -> float:
        return self.law.force(pressure, contraction, self.coefficients, BRAID)

    def volume(self, pressure: float, contraction: float) -> float:
        return self.law.volume(pressure, contraction, self.coefficients, BRAID)


CASES = {
    # With a scale that is not 1, so that a forgotten one is seen.
    name: Case(FORCE_LAWS[name], (1.3, *coefficients_of(group)[1:]))
    for name, group in {**FORCES, "effective_area": PUSHING}.items()
}


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
    this = CASES[name]
    # At the largest contraction the force does not depend on pressure, or hardly.
    kappa = this.contraction(0.98 * share)
    less, more = this.force(pressure, kappa), this.force(1.01 * pressure, kappa)
    if this.law.pressure_range is None:
        assert name == "single_pressure_exponential"
        assert more == less
        return
    if name == "corrected_mckibben":
        assume(less > 0.0)  # above its threshold
    assert (more > less) is not this.law.pushes


@LAWS
@given(pressure=PRESSURES, share=SHARES)
def test_the_force_falls_smoothly_with_contraction(name, pressure, share):
    """Two stencils agree on the slope, and it is negative wherever the muscle pulls."""
    this = CASES[name]
    kappa = this.contraction(share)
    slope, finer = (derivative(lambda k: this.force(pressure, k), kappa, h) for h in (8e-4, 4e-4))
    assert slope == pytest.approx(finer, rel=1e-7, abs=1e-4)
    pulls = this.force(pressure, kappa) > 0.0 or this.law.pushes
    assert slope < 0.0 or not pulls or name == "single_pressure_exponential"


@LAWS
def test_nan_is_passed_on_and_the_volume_depends_on_pressure_as_the_card_says(name):
    this = CASES[name]
    kappa, coefficients = this.contraction(0.4), this.coefficients
    for pressure, contraction in ((math.nan, kappa), (3e5, math.nan), (math.nan, math.nan)):
        assert math.isnan(this.force(pressure, contraction))
    assert math.isnan(this.volume(3e5, math.nan))
    for i in range(len(coefficients)):
        spoilt = (*coefficients[:i], math.nan, *coefficients[i + 1 :])
        assert math.isnan(this.law.force(3e5, kappa, spoilt, BRAID))
    low, high = this.volume(2.5e5, kappa), this.volume(5e5, kappa)
    assert this.law.volume_varies == (low != high)


def test_names_of_compiled_functions_are_unique_among_the_laws():
    """Where all laws meet, functions go by their names: two of one name would hide each other."""
    reached = reached_functions(*ladders().values())
    assert {law.force_function for law in FORCE_LAWS.own()} <= set(reached)
    assert len(set(map(translated_name, reached))) == len(reached)
