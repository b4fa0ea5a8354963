"""Derivatives by complex steps, and the printed static laws they are used for."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.papers.matiskova2021.statics import odd_exponential_basis
from pamsim.papers.numerics import derivative, jacobian, root
from pamsim.recordings.printed import arctangent_law

A = (35.135, -34.4443, 5.470)  # Matiskova 2021, equation (23)
LOOP = (2.7378, -0.0083212, 1.3402, 27.759)  # Alraouf 2025, equation (3)
X = np.linspace(0.0, 6.0, 61)


def test_exponential_law_is_the_printed_formula_and_odd():
    law = A[0] + A[1] * np.exp(-X) + A[2] * X * np.exp(-X)
    both = odd_exponential_basis(np.concatenate([-X, X])) @ np.array(A)
    assert both[: len(X)] == pytest.approx(-both[len(X) :], rel=1e-15)
    assert both[len(X) + 1 :] == pytest.approx(law[1:], rel=1e-13)


def test_complex_steps_give_the_derivatives_of_the_arctangent_law():
    pressure = np.linspace(0.0, 500.0, 11)
    columns = jacobian(lambda a: arctangent_law(pressure, *a), LOOP)
    inner = LOOP[1] * pressure + LOOP[2]
    steep = LOOP[0] / (1.0 + inner**2)
    exact = [np.arctan(inner), steep * pressure, steep, np.ones_like(pressure)]
    assert columns == pytest.approx(np.stack(exact, axis=1), rel=1e-13)


def test_a_complex_step_gives_the_derivative_of_a_function_of_one_number():
    assert derivative(lambda x: x**3 - 2.0 * x, 1.5) == pytest.approx(3.0 * 1.5**2 - 2.0, rel=1e-15)


def test_a_root_is_found_to_its_tolerance():
    assert root(lambda x: x**3 - 2.0, 0.0, 2.0, 1e-12) == pytest.approx(
        2.0 ** (1.0 / 3.0), abs=1e-11
    )
