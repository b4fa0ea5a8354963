"""Braid geometry and the ideal force that follows from it by virtual work."""

from __future__ import annotations

import math

import pytest
from hypothesis import given

from pamsim.physics.braid import max_contraction, volume, volume_slope
from pamsim.physics.force_laws.mckibben import ideal_force
from tests.properties.strategies import BRAIDS, SHARES, between

Braid = tuple[float, float, float]


def fibre(braid: Braid) -> tuple[float, float]:
    """Fibre length b [m] and area b^2 / (4 pi n^2) [m^2], n turns: what V / l is small against."""
    nominal_length, diameter, fibre_angle = braid
    length = nominal_length / math.cos(fibre_angle)
    turns = length * math.sin(fibre_angle) / (math.pi * diameter)
    return length, length * length / (4.0 * math.pi * turns * turns)


@given(BRAIDS, SHARES, between(0.3, 0.85))
def test_volume_is_that_of_the_helix_and_its_slope_its_derivative(braid, share, middle):
    """Nguyen 2024 (4) as printed: V = l (b^2 - l^2) / (4 pi n^2), the cylinder at nominal length.

    It is cubic in l, so the five-point difference is exact at any step.
    """
    straight, area = fibre(braid)
    helix = share * straight * area * (1.0 - share**2)
    found = volume(share * straight, *braid)
    assert found == pytest.approx(helix, abs=1e-12 * area * braid[0])
    cylinder = 0.25 * math.pi * braid[1] ** 2 * braid[0]
    assert volume(braid[0], *braid) == pytest.approx(cylinder, rel=1e-12)
    length, step = middle * straight, 0.05 * straight
    v = [volume(length + k * step, *braid) for k in (-2, -1, 1, 2)]
    difference = (v[0] - 8.0 * v[1] + 8.0 * v[2] - v[3]) / (12.0 * step)
    assert volume_slope(length, *braid) == pytest.approx(difference, abs=1e-12 * area)


@given(BRAIDS, between(1e-6, 0.2))
def test_volume_vanishes_where_the_fibres_lie_straight_and_beyond_there_is_none(braid, beyond):
    straight, area = fibre(braid)
    assert volume(straight, *braid) == pytest.approx(0.0, abs=1e-14 * area * straight)
    assert math.isnan(volume(straight * (1.0 + beyond), *braid))
    assert volume(straight * (1.0 - beyond), *braid) > 0.0


@given(BRAIDS, between(1e-3, 0.2), between(1e3, 1e6))
def test_at_max_contraction_fibres_stand_at_54_7_degrees_the_volume_is_largest_and_no_force_left(
    braid, aside, pressure
):
    largest = braid[0] * (1.0 - max_contraction(braid[2]))
    straight, area = fibre(braid)
    assert math.tan(math.acos(largest / straight)) ** 2 == pytest.approx(2.0, rel=1e-9)
    assert volume_slope(largest, *braid) == pytest.approx(0.0, abs=1e-13 * area)
    for longer in (1.0 + aside, 1.0 - aside):
        assert volume_slope(largest * longer, *braid) * (longer - 1.0) < 0.0
        assert volume(largest, *braid) > volume(largest * longer, *braid)
    zero = ideal_force(pressure, largest, *braid)
    assert zero == pytest.approx(0.0, abs=1e-13 * pressure * area)
    half = ideal_force(pressure, 0.5 * (largest + braid[0]), *braid)
    assert ideal_force(pressure, braid[0], *braid) > half > zero


@given(BRAIDS, between(1e3, 1e6), between(0.0, 0.4), between(0.5, 1.0))
def test_ideal_force_does_the_work_of_the_air_and_is_that_of_sarosi(braid, pressure, start, end):
    """The integral of F dl is -p (V2 - V1); F is quadratic in l, so Simpson's rule is exact.

    Sarosi (1): F = p pi r0^2 (a (1 - kappa)^2 - b), a = 3/tan^2, b = 1/sin^2.
    """
    nominal_length, diameter, fibre_angle = braid
    kappa = max_contraction(fibre_angle)
    long, short = (nominal_length * (1.0 - share * kappa) for share in (start, end))
    ends = ideal_force(pressure, long, *braid) + ideal_force(pressure, short, *braid)
    middle = ideal_force(pressure, 0.5 * (long + short), *braid)
    work = (short - long) / 6.0 * (ends + 4.0 * middle)
    air = -pressure * (volume(short, *braid) - volume(long, *braid))
    assert work < 0.0  # a muscle that shortens by its own force gives work away
    assert work == pytest.approx(air, rel=1e-9)
    a, b = 3.0 / math.tan(fibre_angle) ** 2, 1.0 / math.sin(fibre_angle) ** 2
    base = pressure * math.pi * (0.5 * diameter) ** 2
    for length in (long, short):
        printed = base * (a * (length / nominal_length) ** 2 - b)
        force = ideal_force(pressure, length, *braid)
        assert force == pytest.approx(printed, abs=1e-12 * base * (a + b))
