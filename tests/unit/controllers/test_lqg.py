"""LQG around G2: gains against Riccati equations solved by scipy; its poles, offset, limits."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from pamsim.controllers.model_based import Lqg, LqgMemory
from pamsim.controllers.regulator_design import design_regulator
from tests.unit.controllers.closed_loop import (
    MODEL,
    PERIOD,
    POINT,
    LinearPlant,
    constant,
    out_of_reach_and_back,
    sine,
)

ERROR, INPUT, TIME, PUSH, NOISE = math.radians(2.0), 3e4, 0.3, 1e4, math.radians(0.1)


def designed(largest_input):
    noise = {"input_noise": PUSH, "output_noise": NOISE}
    worst = {"largest_error": ERROR, "largest_input": largest_input}
    return design_regulator(MODEL, period=PERIOD, integral_time=TIME, **worst, **noise)


@pytest.fixture(scope="module")
def lqg():
    return Lqg(design=designed(INPUT), point=POINT, tracking_time=0.3)


@pytest.fixture(scope="module")
def design(lqg):
    return lqg.design


def around(lqg, whole):
    """Plant and memory one sample later, as one vector, with the reference at the trim point."""
    plant = LinearPlant(PERIOD, state=whole[:2])
    memory = LqgMemory(expected=tuple(whole[2:4]), integral=whole[4])
    command, memory = lqg.step(plant.observation(), memory)
    plant.take(command)
    return np.array([*plant.state, *memory.expected, memory.integral])


def test_the_closed_loop_has_the_poles_of_feedback_and_of_filter(lqg):
    size = np.array([1e-2, 1e-1, 1e-2, 1e-1, 1e-3])
    rest = around(lqg, np.zeros(5))
    np.testing.assert_allclose(rest, 0.0, atol=1e-12)
    columns = [(around(lqg, s * unit) - rest) / s for s, unit in zip(size, np.eye(5), strict=True)]
    poles = np.linalg.eigvals(np.column_stack(columns))
    a = np.array(lqg.design.transition)
    correction = np.outer(lqg.design.correction, [1.0, 0.0])
    wanted = [*lqg.design.poles, *np.linalg.eigvals(a @ (np.eye(2) - correction))]
    np.testing.assert_allclose(np.sort_complex(poles), np.sort_complex(wanted), atol=1e-6)
    assert max(abs(pole) for pole in wanted) < 1.0


def test_the_filter_corrects_by_the_gain_of_least_variance(design):
    a, b, c = np.array(design.transition), np.array(design.input)[:, None], np.array([[1.0, 0.0]])
    before = solve_discrete_are(a.T, c.T, PUSH**2 * b @ b.T, np.array([[NOISE**2]]))
    best = before @ c.T / (c @ before @ c.T + NOISE**2)
    assert design.correction == pytest.approx(best[:, 0])
    at_rest = np.linalg.solve(np.eye(2) - a, b)[:, 0]
    assert at_rest == pytest.approx((MODEL.gain, 0.0), abs=1e-15)


def test_the_feedback_costs_least_and_is_faster_the_cheaper_the_input(design):
    integral = np.array([[-PERIOD, 0.0, 1.0]])
    a = np.block([[np.array(design.transition), np.zeros((2, 1))], [integral]])
    b = np.array([*design.input, 0.0])[:, None]
    cost, dear = np.diag([ERROR**-2.0, 0.0, (ERROR * TIME) ** -2.0]), np.array([[INPUT**-2.0]])
    riccati = solve_discrete_are(a, b, cost, dear)
    best = np.linalg.solve(dear + b.T @ riccati @ b, b.T @ riccati @ a)[0]
    assert (*design.feedback, -design.integral_gain) == pytest.approx(best, rel=1e-6)
    poles = np.linalg.eigvals(a - b @ best[None])
    np.testing.assert_allclose(np.sort_complex(design.poles), np.sort_complex(poles), rtol=1e-6)
    slowest = [max(map(abs, designed(size).poles)) for size in (1e5, 1e4, 1e3)]
    assert slowest[0] < slowest[1] < slowest[2] < 1.0


def test_the_integral_takes_a_constant_disturbance(lqg):
    plant = LinearPlant(PERIOD, disturbance=lambda time: 1.5e4)
    angles, _ = plant.close(lqg, constant(POINT.angle + 0.1), 400)
    assert angles[-1] == pytest.approx(POINT.angle + 0.1, abs=1e-6)


def test_a_moving_reference_is_followed_by_the_models_own_input(lqg):
    def wanted(time):
        angle, rate, acceleration = sine(0.5, 5.0)(time)
        return POINT.angle + angle, rate, acceleration

    angles, _ = LinearPlant(PERIOD).close(lqg, wanted, 300)
    goal = np.array([wanted(k * PERIOD)[0] for k in range(300)])
    assert np.max(np.abs(angles - goal)[100:]) < math.radians(0.2)


def test_at_the_limits_the_filter_still_knows_where_the_arm_is(lqg):
    plant = LinearPlant(PERIOD)
    memory = lqg.start(plant.observation())
    for _ in range(60):
        command, memory = lqg.step(plant.observation((3.0, 0.0, 0.0)), memory)
        plant.take(command)
    assert command[1] == 0.0
    np.testing.assert_allclose(memory.expected, plant.state, atol=1e-6)


def test_it_comes_back_from_the_limits_where_a_wound_up_one_does_not(lqg):
    wound = dataclasses.replace(lqg, tracking_time=math.inf)
    tracked, left = (
        LinearPlant(PERIOD).close(one, out_of_reach_and_back, 350)[0] for one in (lqg, wound)
    )
    assert abs(tracked[-1] - 0.2) < 0.1 < 1.0 < abs(left[-1] - 0.2)
