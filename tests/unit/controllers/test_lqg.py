"""LQG around G2: its poles, its offset, its limits."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from pamsim.controllers.model_based import Lqg, LqgMemory
from pamsim.controllers.regulator_design import design_regulator
from tests.unit.controllers.closed_loop import PERIOD, constant, sine
from tests.unit.controllers.linear_plant import MODEL, POINT, LinearPlant


@pytest.fixture(scope="module")
def lqg():
    design = design_regulator(
        MODEL,
        period=PERIOD,
        largest_error=math.radians(2.0),
        largest_input=3e4,
        integral_time=0.3,
        input_noise=1e4,
        output_noise=math.radians(0.1),
    )
    return Lqg(design=design, point=POINT, tracking_time=0.3)


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


def test_cheaper_input_makes_a_faster_loop():
    def slowest(largest_input):
        design = design_regulator(
            MODEL,
            period=PERIOD,
            largest_error=0.03,
            largest_input=largest_input,
            input_noise=1e4,
            output_noise=1e-3,
        )
        return max(abs(pole) for pole in design.poles)

    assert slowest(1e5) < slowest(1e4) < slowest(1e3) < 1.0


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
    def wanted(time):
        return (3.0, 0.0, 0.0) if time < 6.0 else (0.2, 0.0, 0.0)

    tracked, _ = LinearPlant(PERIOD).close(lqg, wanted, 350)
    wound = dataclasses.replace(lqg, tracking_time=math.inf)
    left, _ = LinearPlant(PERIOD).close(wound, wanted, 350)
    assert abs(tracked[-1] - 0.2) < 0.1 < 1.0 < abs(left[-1] - 0.2)
