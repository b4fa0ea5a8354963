"""The catalog: which laws, in which range, and how they take their coefficients."""

from __future__ import annotations

import math

import pytest

from pamsim.physics.braid import Braid
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.force_law import coefficients_of
from pamsim.physics.force_laws.pleated import SLENDERNESS_6, PleatedShape
from pamsim.physics.force_laws.published import PUBLISHED

BRAID = Braid(nominal_length=0.3, diameter=0.02, fibre_angle=math.radians(28.6))
LARGEST = 1.0 - 1.0 / (math.sqrt(3.0) * math.cos(math.radians(28.6)))


@pytest.mark.parametrize(
    ("name", "contractions", "pressures"),
    [
        ("ideal_mckibben", (0.0, LARGEST), (0.0, math.inf)),
        ("six_parameter", (0.0, 0.25), (0.0, 6e5)),
        ("corrected_mckibben", (0.0, 0.25), (2e5, 6e5)),
        ("single_pressure_exponential", (0.0, 0.25), None),
        ("invertible_exponential", (0.0, 0.25), (0.0, 6e5)),
        ("elastic_energy", (0.0, LARGEST), (0.0, math.inf)),
        ("pleated", (0.05, 0.35), (1e5, 2.5e5)),
        ("pleated_shape", (0.05, 0.40252), (1e5, 2.5e5)),
    ],
)
def test_range_each_source_vouches_for(name, contractions, pressures):
    law = FORCE_LAWS[name]
    coefficients = coefficients_of(PleatedShape(slenderness=6.0))
    assert law.contraction_range(coefficients, BRAID) == pytest.approx(contractions, abs=1e-5)
    assert law.pressure_range == pressures


def test_the_uniform_signature_reads_the_coefficients_in_declared_order():
    law = PUBLISHED["DMSP-20-200"]
    percent, bar = 10.0, 4.0
    printed = (
        (-4.00180705 * bar + 292.4620246) * math.exp(-0.32930845 * percent)
        - 9.33564098 * bar * percent
        + 294.0538256 * bar
        - 280.498151
    )
    coefficients = (0.5, *coefficients_of(law)[1:])
    force = FORCE_LAWS["six_parameter"].force(4e5, 0.1, coefficients, BRAID)
    assert force == pytest.approx(0.5 * printed, rel=1e-12)


def test_a_pleated_muscle_scales_with_the_square_of_its_length():
    law, coefficients = FORCE_LAWS["pleated"], coefficients_of(SLENDERNESS_6)
    twice = Braid(nominal_length=0.6, diameter=0.02, fibre_angle=0.5)
    ratio = law.force(1e5, 0.2, coefficients, twice) / law.force(1e5, 0.2, coefficients, BRAID)
    assert ratio == pytest.approx(4.0, rel=1e-14)
