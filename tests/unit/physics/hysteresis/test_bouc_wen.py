"""Bouc-Wen hysteresis where it has a closed form, and at the limits of its shape parameters."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pamsim.physics.hysteresis.bouc_wen import bouc_wen_rate

TRAVEL = 0.005


def driven(start: float, end: float, sigma: float, sharpness: float) -> float:
    """z after the input has moved by ``end`` yield travels in one direction."""
    direction = math.copysign(1.0, end)

    def rate(_time, z):
        return [bouc_wen_rate(float(z[0]), direction, TRAVEL, sigma, sharpness)]

    span, fine = (0.0, abs(end) * TRAVEL), 0.05 * TRAVEL
    solved = solve_ivp(rate, span, [start], rtol=1e-10, atol=1e-12, max_step=fine)
    return float(solved.y[0, -1])


@pytest.mark.parametrize("sigma", [0.5, 0.7, 2.0])
@pytest.mark.parametrize("distance", [0.1, 1.0, 3.0, -1.0])
def test_virgin_curves(sigma, distance):
    """From rest dz/dx = (1 - z^n)/D: an exponential for n = 1, a hyperbolic tangent for n = 2."""
    size, sign = abs(distance), math.copysign(1.0, distance)
    assert driven(0.0, distance, sigma, 1.0) == pytest.approx(sign * (1.0 - math.exp(-size)))
    assert driven(0.0, distance, sigma, 2.0) == pytest.approx(sign * math.tanh(size))


def test_sharper_knees_approach_ideal_plasticity_from_below():
    distances = np.linspace(0.1, 2.0, 20)
    ideal = np.minimum(distances, 1.0)
    missing = [
        ideal - [driven(0.0, float(distance), 0.5, sharpness) for distance in distances]
        for sharpness in (1.0, 2.0, 5.0, 20.0)
    ]
    assert np.all(np.array(missing) >= -1e-9)
    largest = np.max(missing, axis=1)
    assert np.all(np.diff(largest) < 0.0)
    assert largest[-1] < 0.1


@pytest.mark.parametrize("sharpness", [1.0, 3.0, 20.0])
def test_sigma_one_half_unloads_along_the_initial_slope(sharpness):
    for z in np.linspace(-1.0, 1.0, 21).tolist():
        unloading = bouc_wen_rate(z, -1.0 if z > 0.0 else 1.0, TRAVEL, 0.5, sharpness)
        assert abs(unloading) == pytest.approx(1.0 / TRAVEL, rel=1e-14)


@pytest.mark.parametrize("sigma", [0.5, 1.0, 10.0])
@pytest.mark.parametrize("sharpness", [1.0, 20.0])
def test_slopes_at_the_ends(sigma, sharpness):
    """1/D from rest; none left at saturation; 2 sigma / D when a saturated loop turns back."""
    shape = (TRAVEL, sigma, sharpness)
    assert bouc_wen_rate(0.0, 1.0, *shape) == pytest.approx(1.0 / TRAVEL)
    assert bouc_wen_rate(1.0, 1.0, *shape) == pytest.approx(0.0, abs=1e-12 / TRAVEL)
    assert bouc_wen_rate(1.0, -1.0, *shape) == pytest.approx(-2.0 * sigma / TRAVEL)


def test_nan_is_passed_on():
    assert math.isnan(bouc_wen_rate(math.nan, 1.0, TRAVEL, 0.5, 1.0))
    assert math.isnan(bouc_wen_rate(0.1, math.nan, TRAVEL, 0.5, 1.0))
