"""A controller of python-control in pamsim: the same answer, the same loop, and its limits."""

from __future__ import annotations

import control
import numpy as np
import pytest

import pamsim
from pamsim.controllers.controller import PressureSplit
from pamsim.controllers.model_based import LinearisationPoint, Lti, linear_controller
from pamsim.controllers.sampled_controller import sampled_controller
from tests.unit.controllers.closed_loop import LEVEL, PERIOD, SUPPLY, observe
from tests.unit.controllers.linear_plant import MODEL, POINT, LinearPlant

PID = control.tf([8e3, 1.2e5, 9e5], [0.01, 1.0, 0.0])  # Pa/rad
SYSTEMS = {
    "continuous": PID,
    "discrete": control.sample_system(PID, PERIOD, method="tustin"),
    "state space": control.ss([[-3.0, 1.0], [0.0, -0.5]], [[2.0], [5.0]], [[1e4, 2e4]], [[3e4]]),
    "strictly proper": control.tf([1e5], [0.2, 1.0]),
    "static": control.tf([1e5], [1.0]),
    "two inputs": control.ss(
        [[-3.0, 1.0], [0.0, -0.5]], [[2.0, 0.1], [5.0, -7.0]], [[1e4, 2e4]], [[3e4, -2e4]]
    ),
}


@pytest.mark.parametrize("name", SYSTEMS)
def test_it_answers_as_python_control_says(name):
    system = SYSTEMS[name]
    controller = Lti(design=sampled_controller(system, PERIOD), point=POINT)
    draw = np.random.default_rng(1)
    wanted, angle = 0.02 * draw.normal(size=(2, 100))
    first, second = POINT.pressures(0.0)
    memory = controller.start(observe(pressure=(first, second)))
    given = []
    for r, y in zip(wanted, angle, strict=True):
        seen = observe(angle=POINT.angle + y, wanted=(POINT.angle + r, 0.0, 0.0))
        command, memory = controller.step(seen, memory)
        given.append(command[0] - command[1] - POINT.difference)
    assert max(map(abs, given)) < 1e5  # within the limits
    sampled = system if system.isdtime() else control.sample_system(system, PERIOD, "tustin")
    signals = np.vstack([wanted, angle]) if system.ninputs == 2 else wanted - angle
    expected = control.forced_response(sampled, np.arange(100) * PERIOD, signals).outputs
    np.testing.assert_allclose(given, np.ravel(expected), atol=1e-9 * np.max(np.abs(expected)))


def test_the_closed_loop_is_that_of_python_control():
    a, b = MODEL.matrices()
    plant = control.sample_system(control.ss(a, b, [[1.0, 0.0]], 0.0), PERIOD, method="zoh")
    design = sampled_controller(PID, PERIOD)
    loop = control.feedback(SYSTEMS["discrete"] * control.ss2tf(plant), 1)
    expected = control.step_response(loop, np.arange(60) * PERIOD).outputs
    angles, _ = LinearPlant(PERIOD).close(
        Lti(design=design, point=POINT), lambda t: (POINT.angle + 0.1, 0.0, 0.0), 60
    )
    np.testing.assert_allclose(angles - POINT.angle, 0.1 * expected, atol=1e-9)


def test_a_rig_at_rest_stays_where_it_is():
    rig, common = pamsim.load_rig("mas20_arm"), 2.5e5
    controller = linear_controller(PID, rig, period=PERIOD, common=common, load=1.2)
    rest = controller.point.angle
    seen = observe(angle=rest, wanted=(rest, 0.0, 0.0), pressure=(common, common))
    command, _ = controller.step(seen, controller.start(seen))
    np.testing.assert_allclose(command, (common, common))
    hold = pamsim.pressure_step(command, command, duration=1.0, load=1.2)
    np.testing.assert_allclose(pamsim.simulate(rig, hold).completed().angle, rest, atol=1e-4)


def test_it_begins_with_the_pressures_that_are_there():
    controller = Lti(design=sampled_controller(PID, PERIOD), point=POINT)
    first = observe(angle=0.2, pressure=(LEVEL + 3e4, LEVEL - 3e4), wanted=(0.2, 0.0, 0.0))
    command, _ = controller.step(first, controller.start(first))
    assert command == pytest.approx(first.pressure)


def test_a_limited_output_does_not_wind_up():
    narrow = LinearisationPoint(
        split=PressureSplit(common=LEVEL, supply=SUPPLY), difference=5.4e5, angle=POINT.angle
    )
    conditioned = sampled_controller(PID, PERIOD)
    free = sampled_controller(PID, PERIOD, back_calculation=np.zeros(2))

    def overshoot(design, point):
        controller = Lti(design=design, point=point)
        plant, memory, angles = LinearPlant(PERIOD), None, []
        for k in range(250):
            goal = POINT.angle + (0.25 if k < 100 else 0.1)  # 0.25 rad is out of reach
            seen = observe(
                angle=POINT.angle + float(plant.state[0]),
                pressure=point.pressures(0.0),
                wanted=(goal, 0.0, 0.0),
            )
            memory = controller.start(seen) if memory is None else memory
            command, memory = controller.step(seen, memory)
            plant.take((command[0] - point.difference + POINT.difference, command[1]))
            angles.append(float(plant.state[0]))
        return np.array(angles)

    # After the goal has come back into reach, the angle follows at once.
    late = overshoot(free, narrow)[110:]
    prompt = overshoot(conditioned, narrow)[110:]
    assert np.max(np.abs(prompt - 0.1)) < 0.5 * np.max(np.abs(late - 0.1))
    assert prompt[-1] == pytest.approx(0.1, abs=1e-3)
