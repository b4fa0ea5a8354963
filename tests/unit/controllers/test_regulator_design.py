"""The regulator's gains against Riccati equations solved by scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from pamsim.controllers.regulator_design import design_regulator
from pamsim.controllers.second_order_model import SecondOrderModel

MODEL = SecondOrderModel(gain=3e-6, a1=0.066, a2=0.0092)


@pytest.fixture(scope="module")
def design():
    return design_regulator(
        MODEL,
        period=0.02,
        largest_error=0.03,
        largest_input=3e4,
        integral_time=0.3,
        input_noise=1e4,
        output_noise=2e-3,
    )


def test_the_filter_corrects_by_the_gain_of_least_variance(design):
    a, b, c = np.array(design.transition), np.array(design.input)[:, None], np.array([[1.0, 0.0]])
    before = solve_discrete_are(a.T, c.T, 1e8 * b @ b.T, np.array([[4e-6]]))
    best = before @ c.T / (c @ before @ c.T + 4e-6)
    assert design.correction == pytest.approx(best[:, 0])


def test_the_feedback_costs_least(design):
    a = np.block([[np.array(design.transition), np.zeros((2, 1))], [np.array([[-0.02, 0.0, 1.0]])]])
    b = np.array([*design.input, 0.0])[:, None]
    cost = np.diag([0.03**-2.0, 0.0, (0.03 * 0.3) ** -2.0])
    riccati = solve_discrete_are(a, b, cost, np.array([[3e4**-2.0]]))
    best = np.linalg.solve(3e4**-2.0 + b.T @ riccati @ b, b.T @ riccati @ a)[0]
    assert (*design.feedback, -design.integral_gain) == pytest.approx(best, rel=1e-6)
    poles = np.linalg.eigvals(a - b @ best[None])
    np.testing.assert_allclose(np.sort_complex(design.poles), np.sort_complex(poles), rtol=1e-6)


def test_the_sampled_model_has_the_gain_at_rest_of_g2(design):
    at_rest = np.linalg.solve(np.eye(2) - np.array(design.transition), np.array(design.input))
    assert at_rest == pytest.approx((MODEL.gain, 0.0), abs=1e-15)
