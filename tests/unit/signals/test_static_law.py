"""Static laws: linear in their basis, derivatives as differences give them, odd where told."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.signals.static_law import (
    arctangent_jacobian,
    arctangent_law,
    exponential_law,
    exponential_slope,
    odd_exponential_basis,
)

A = (35.135, -34.4443, 5.470)  # Matiskova 2021, equation (23)
LOOP = (2.7378, -0.0083212, 1.3402, 27.759)  # Alraouf 2025, equation (3)
X = np.linspace(0.0, 6.0, 61)


def test_exponential_law_is_the_printed_formula():
    assert exponential_law(X, *A) == pytest.approx(
        A[0] + A[1] * np.exp(-X) + A[2] * X * np.exp(-X), rel=1e-13
    )


def test_exponential_slope_is_its_derivative():
    h = 1e-6
    slope = (exponential_law(X + h, *A) - exponential_law(X - h, *A)) / (2.0 * h)
    assert exponential_slope(X, *A[1:]) == pytest.approx(slope, abs=1e-6)


def test_odd_continuation_is_odd_and_the_law_itself_on_the_right():
    both = odd_exponential_basis(np.concatenate([-X, X])) @ np.array(A)
    assert both[: len(X)] == pytest.approx(-both[len(X) :], rel=1e-15)
    assert both[len(X) + 1 :] == pytest.approx(exponential_law(X, *A)[1:], rel=1e-13)


def test_arctangent_jacobian_is_that_of_the_law():
    pressure = np.linspace(0.0, 500.0, 11)
    found = arctangent_jacobian(pressure, *LOOP[:3])
    for index, value in enumerate(LOOP):
        h = 1e-6 * abs(value)
        up, down = list(LOOP), list(LOOP)
        up[index] += h
        down[index] -= h
        slope = arctangent_law(pressure, *up) - arctangent_law(pressure, *down)
        assert found[:, index] == pytest.approx(slope / (2.0 * h), rel=1e-5, abs=1e-7)
