"""LQG and sliding mode around G2: gains by scipy's Riccati equations, poles, offset, limits."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from pamsim.controllers.model_based import Lqg, LqgMemory, SlidingMode
from pamsim.controllers.regulator_design import design_regulator
from tests.unit.controllers.closed_loop import (
    MODEL,
    PERIOD,
    POINT,
    LinearPlant,
    constant,
    observe,
    out_of_reach_and_back,
    sine,
)

ERROR, INPUT, TIME, PUSH, NOISE = math.radians(2.0), 3e4, 0.3, 1e4, math.radians(0.1)


def designed(largest_input):
    noise = {"input_noise": PUSH, "output_noise": NOISE}
    worst = {"largest_error": ERROR, "largest_input": largest_input}
    return design_regulator(MODEL, period=PERIOD, integral_time=TIME, **worst, **noise)


LQG = Lqg(design=designed(INPUT), point=POINT, tracking_time=0.3)
DESIGN = LQG.design
A, B = np.array(DESIGN.transition), np.array(DESIGN.input)[:, None]


def around(whole):
    """Plant and memory one sample later, as one vector, with the reference at the trim point."""
    plant = LinearPlant(PERIOD, state=whole[:2])
    memory = LqgMemory(expected=tuple(whole[2:4]), integral=whole[4])
    command, memory = LQG.step(plant.observation(), memory)
    plant.take(command)
    return np.array([*plant.state, *memory.expected, memory.integral])


def test_the_closed_loop_has_the_poles_of_feedback_and_of_filter():
    size = np.array([1e-2, 1e-1, 1e-2, 1e-1, 1e-3])
    rest = around(np.zeros(5))
    np.testing.assert_allclose(rest, 0.0, atol=1e-12)
    columns = [(around(s * unit) - rest) / s for s, unit in zip(size, np.eye(5), strict=True)]
    poles = np.linalg.eigvals(np.column_stack(columns))
    correction = np.outer(DESIGN.correction, [1.0, 0.0])
    wanted = [*DESIGN.poles, *np.linalg.eigvals(A @ (np.eye(2) - correction))]
    np.testing.assert_allclose(np.sort_complex(poles), np.sort_complex(wanted), atol=1e-6)
    assert max(abs(pole) for pole in wanted) < 1.0


def test_the_filter_corrects_by_the_gain_of_least_variance():
    c = np.array([[1.0, 0.0]])
    before = solve_discrete_are(A.T, c.T, PUSH**2 * B @ B.T, np.array([[NOISE**2]]))
    best = before @ c.T / (c @ before @ c.T + NOISE**2)
    assert DESIGN.correction == pytest.approx(best[:, 0])
    at_rest = np.linalg.solve(np.eye(2) - A, B)[:, 0]
    assert at_rest == pytest.approx((MODEL.gain, 0.0), abs=1e-15)


def test_the_feedback_costs_least_and_is_faster_the_cheaper_the_input():
    a = np.block([[A, np.zeros((2, 1))], [np.array([[-PERIOD, 0.0, 1.0]])]])
    b = np.array([*DESIGN.input, 0.0])[:, None]
    cost, dear = np.diag([ERROR**-2.0, 0.0, (ERROR * TIME) ** -2.0]), np.array([[INPUT**-2.0]])
    riccati = solve_discrete_are(a, b, cost, dear)
    best = np.linalg.solve(dear + b.T @ riccati @ b, b.T @ riccati @ a)[0]
    assert (*DESIGN.feedback, -DESIGN.integral_gain) == pytest.approx(best, rel=1e-6)
    poles = np.linalg.eigvals(a - b @ best[None])
    np.testing.assert_allclose(np.sort_complex(DESIGN.poles), np.sort_complex(poles), rtol=1e-6)
    slowest = [max(map(abs, designed(size).poles)) for size in (1e5, 1e4, 1e3)]
    assert slowest[0] < slowest[1] < slowest[2] < 1.0


def test_a_disturbance_is_taken_and_a_moving_reference_followed_by_the_models_own_input():
    plant = LinearPlant(PERIOD, disturbance=lambda time: 1.5e4)
    angles, _ = plant.close(LQG, constant(POINT.angle + 0.1), 400)
    assert angles[-1] == pytest.approx(POINT.angle + 0.1, abs=1e-6)

    def wanted(time):
        angle, rate, acceleration = sine(0.5, 5.0)(time)
        return POINT.angle + angle, rate, acceleration

    angles, _ = LinearPlant(PERIOD).close(LQG, wanted, 300)
    goal = np.array([wanted(k * PERIOD)[0] for k in range(300)])
    assert np.max(np.abs(angles - goal)[100:]) < math.radians(0.2)


def test_it_comes_back_from_the_limits_and_knows_there_where_the_arm_is():
    wound = dataclasses.replace(LQG, tracking_time=math.inf)
    tracked, left = (
        LinearPlant(PERIOD).close(one, out_of_reach_and_back, 350)[0] for one in (LQG, wound)
    )
    assert abs(tracked[-1] - 0.2) < 0.1 < 1.0 < abs(left[-1] - 0.2)
    plant = LinearPlant(PERIOD)
    memory = LQG.start(plant.observation())
    for _ in range(60):
        command, memory = LQG.step(plant.observation((3.0, 0.0, 0.0)), memory)
        plant.take(command)
    assert command[1] == 0.0
    np.testing.assert_allclose(memory.expected, plant.state, atol=1e-6)


FINE = 1e-3


def sliding(reach=20.0):
    own = {"period": FINE, "bandwidth": 6.0, "layer": 0.5}
    return SlidingMode(model=MODEL, point=POINT, reach=reach, **own)


def surfaces(controller, disturbance, samples):
    plant = LinearPlant(FINE, disturbance=disturbance, state=(0.0, 3.0))
    memory, found, angles = controller.start(plant.observation()), [], []
    for _ in range(samples):
        observation = plant.observation()
        found.append(controller.surface(observation, memory))
        angles.append(observation.joint.position)
        command, memory = controller.step(observation, memory)
        plant.take(command)
    return np.array(found), np.array(angles)


@pytest.mark.parametrize("disturbance", [lambda t: PUSH, lambda t: PUSH * math.sin(30.0 * t)])
def test_sliding_mode_reaches_the_layer_in_the_time_it_says_and_stays(disturbance):
    controller = sliding()
    found, _ = surfaces(controller, disturbance, 1500)
    pushed = MODEL.gain / MODEL.a2 * PUSH
    assert pushed < controller.reach
    latest = (abs(found[0]) - controller.layer) / (controller.reach - pushed)
    assert abs(found[0]) > controller.layer
    after = np.abs(found[math.ceil(latest / FINE) + 1 :])
    assert np.all(after <= controller.layer * 1.01)


def test_sliding_mode_has_no_offset_and_an_integral_that_waits_at_the_limits():
    _, angles = surfaces(sliding(), lambda t: PUSH, 4000)
    assert angles[-1] == pytest.approx(POINT.angle, abs=1e-5)
    # A disturbance beyond its reach throws it out.
    found, _ = surfaces(sliding(reach=2.0), lambda t: 3.0 * PUSH, 1500)
    assert np.max(np.abs(found[500:])) > 0.5
    observation = observe(angle=POINT.angle, wanted=(9.0, 0.0, 0.0))
    command, after = sliding().step(observation, -0.3)
    assert (command, after) == ((POINT.split.supply, 0.0), -0.3)
