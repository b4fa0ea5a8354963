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
    """Fibre length b [m] and number of turns n [-] of a braid: the paper's own parameters."""
    nominal_length, diameter, fibre_angle = braid
    length = nominal_length / math.cos(fibre_angle)
    return length, length * math.sin(fibre_angle) / (math.pi * diameter)


def helix_volume(length: float, braid: Braid) -> float:
    """Nguyen 2024 (4) as printed: V = l (b^2 - l^2) / (4 pi n^2)."""
    b, n = fibre(braid)
    return length * (b * b - length * length) / (4.0 * math.pi * n * n)


def helix_area(braid: Braid) -> float:
    """b^2 / (4 pi n^2) [m^2]: what V / l and dV/dl are small against or as large as."""
    b, n = fibre(braid)
    return b * b / (4.0 * math.pi * n * n)


@given(BRAIDS, SHARES)
def test_volume_is_that_of_the_helix(braid, share):
    length = share * fibre(braid)[0]
    tolerance = 1e-12 * helix_area(braid) * braid[0]
    assert volume(length, *braid) == pytest.approx(helix_volume(length, braid), abs=tolerance)


@given(BRAIDS)
def test_volume_at_nominal_length_is_the_cylinder(braid):
    nominal_length, diameter, _ = braid
    cylinder = 0.25 * math.pi * diameter**2 * nominal_length
    assert volume(nominal_length, *braid) == pytest.approx(cylinder, rel=1e-12)


@given(BRAIDS, between(0.3, 0.85))
def test_slope_is_the_derivative_of_volume(braid, share):
    """V is cubic in l, so the five-point difference is exact at any step."""
    straight = fibre(braid)[0]
    length, step = share * straight, 0.05 * straight
    v = [volume(length + k * step, *braid) for k in (-2, -1, 1, 2)]
    difference = (v[0] - 8.0 * v[1] + 8.0 * v[2] - v[3]) / (12.0 * step)
    tolerance = 1e-12 * helix_area(braid)
    assert volume_slope(length, *braid) == pytest.approx(difference, abs=tolerance)


@given(BRAIDS, between(1e-9, 0.2))
def test_volume_vanishes_where_the_fibres_lie_straight(braid, beyond):
    straight = fibre(braid)[0]
    scale = helix_area(braid) * straight
    assert volume(straight, *braid) == pytest.approx(0.0, abs=1e-14 * scale)
    assert volume(straight * (1.0 + beyond), *braid) == 0.0
    assert volume(straight * (1.0 - beyond), *braid) > 0.0


@given(BRAIDS, between(1e-3, 0.2))
def test_max_contraction_is_where_the_volume_is_largest(braid, aside):
    largest = braid[0] * (1.0 - max_contraction(braid[2]))
    area = helix_area(braid)
    assert volume_slope(largest, *braid) == pytest.approx(0.0, abs=1e-13 * area)
    assert (
        volume_slope(largest * (1.0 + aside), *braid)
        < 0.0
        < volume_slope(largest * (1.0 - aside), *braid)
    )
    assert volume(largest, *braid) > volume(largest * (1.0 + aside), *braid)
    assert volume(largest, *braid) > volume(largest * (1.0 - aside), *braid)


@given(BRAIDS)
def test_fibres_stand_at_54_7_degrees_at_max_contraction(braid):
    length = braid[0] * (1.0 - max_contraction(braid[2]))
    angle = math.acos(length / fibre(braid)[0])
    assert math.tan(angle) ** 2 == pytest.approx(2.0, rel=1e-9)


@given(BRAIDS, between(1e3, 1e6), between(0.0, 0.4), between(0.5, 1.0))
def test_ideal_force_does_the_work_of_the_air(braid, pressure, start, end):
    """The integral of F dl is -p (V2 - V1); F is quadratic in l, so Simpson's rule is exact."""
    kappa = max_contraction(braid[2])
    long, short = braid[0] * (1.0 - start * kappa), braid[0] * (1.0 - end * kappa)
    ends = ideal_force(pressure, long, *braid) + ideal_force(pressure, short, *braid)
    middle = ideal_force(pressure, 0.5 * (long + short), *braid)
    work = (short - long) / 6.0 * (ends + 4.0 * middle)
    air = -pressure * (volume(short, *braid) - volume(long, *braid))
    assert work < 0.0  # a muscle that shortens by its own force gives work away
    assert work == pytest.approx(air, rel=1e-9)


@given(BRAIDS, between(1.0, 1e6), between(0.0, 0.6))
def test_ideal_force_is_that_of_sarosi(braid, pressure, contraction):
    """Sarosi (1): F = p pi r0^2 (a (1 - kappa)^2 - b), a = 3/tan^2, b = 1/sin^2."""
    nominal_length, diameter, fibre_angle = braid
    a, b = 3.0 / math.tan(fibre_angle) ** 2, 1.0 / math.sin(fibre_angle) ** 2
    base = pressure * math.pi * (0.5 * diameter) ** 2
    printed = base * (a * (1.0 - contraction) ** 2 - b)
    force = ideal_force(pressure, nominal_length * (1.0 - contraction), *braid)
    assert force == pytest.approx(printed, abs=1e-12 * base * (a + b))


@given(BRAIDS, between(1e3, 1e6))
def test_ideal_force_vanishes_at_max_contraction_and_pulls_before(braid, pressure):
    kappa = max_contraction(braid[2])
    full = ideal_force(pressure, braid[0], *braid)
    zero = ideal_force(pressure, braid[0] * (1.0 - kappa), *braid)
    assert zero == pytest.approx(0.0, abs=1e-13 * pressure * helix_area(braid))
    assert full > ideal_force(pressure, braid[0] * (1.0 - 0.5 * kappa), *braid) > zero
