"""A controller of python-control in pamsim: the same answer, the same loop, and its limits."""

import control
import numpy as np
import pytest

import pamsim
from pamsim.controllers.model_based import Lti, linear_controller, linearise_arm
from pamsim.controllers.sampled_controller import sampled_controller
from pamsim.engine.equilibrium import rest_angles
from pamsim.identification.status import FitStatus
from tests.unit.controllers.closed_loop import (
    LEVEL,
    PERIOD,
    POINT,
    SPLIT,
    LinearPlant,
    observe,
    out_of_reach_and_back,
)
from tests.unit.core.refusals import all_refused

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


def test_it_begins_with_the_pressures_that_are_there_and_a_rig_at_rest_stays():
    controller = Lti(design=sampled_controller(PID, PERIOD), point=POINT)
    first = observe(angle=0.2, pressure=(LEVEL + 3e4, LEVEL - 3e4), wanted=(0.2, 0.0, 0.0))
    assert controller.step(first, controller.start(first))[0] == pytest.approx(first.pressure)
    rig, common = pamsim.load_rig("mas20_arm"), 2.5e5
    controller = linear_controller(PID, rig, period=PERIOD, common=common, load=1.2)
    rest = controller.point.angle
    seen = observe(angle=rest, wanted=(rest, 0.0, 0.0), pressure=(common, common))
    command, _ = controller.step(seen, controller.start(seen))
    np.testing.assert_allclose(command, (common, common))
    hold = pamsim.pressure_step(command, command, duration=1.0, load=1.2)
    np.testing.assert_allclose(pamsim.simulate(rig, hold).completed().angle, rest, atol=1e-4)


def test_a_limited_output_does_not_wind_up():
    free = sampled_controller(PID, PERIOD, back_calculation=np.zeros(2))
    prompt, late = (
        LinearPlant(PERIOD).close(Lti(design=design, point=POINT), out_of_reach_and_back, 400)[0]
        for design in (sampled_controller(PID, PERIOD), free)
    )
    assert abs(prompt[-1] - 0.2) < 0.1 < 1.0 < abs(late[-1] - 0.2)


def test_conditioning_needs_a_direct_path_and_stable_zeros():
    assert any(sampled_controller(PID, PERIOD).correction)
    assert sampled_controller(control.tf([1.0], [1.0, 0.0], PERIOD), PERIOD).correction == (0.0,)
    unstable_zero = control.tf([1.0, -2.0], [1.0, -1.0], PERIOD)
    assert sampled_controller(unstable_zero, PERIOD).correction == (0.0,)
    own = sampled_controller(unstable_zero, PERIOD, back_calculation=np.array([0.3]))
    assert own.correction == (0.3,)


def test_what_is_no_controller_is_refused():
    two = control.tf([[[1.0], [2.0]]], [[[1.0, 1.0], [1.0, 2.0]]])
    three = control.ss([[0.1]], np.ones((1, 3)), [[1.0]], 0.0, PERIOD)
    bad = {
        "zeros": (control.tf([1.0, 0.0], [1.0]), {}, "more zeros than poles"),
        "period": (control.tf([1.0], [1.0, 0.5], 0.01), {}, "is sampled at 0.01 s"),
        "two": (two, {}, "needs slycot"),
        "three": (three, {}, "3 inputs"),
        "states": (PID, {"back_calculation": np.zeros(5)}, "2 states"),
        "no period": (PID, {"period": 0.0}, "must be above 0"),
    }

    def sample(system, changes):
        sampled_controller(system, **({"period": PERIOD} | changes))

    all_refused(bad, sample)


def test_a_linearised_arm_has_the_gain_and_the_angle_at_rest():
    rig = pamsim.load_rig("mas20_arm").with_parameters({"hysteresis.force_per_pressure": 0.0})
    found = linearise_arm(rig, SPLIT, difference=5e4, load=1.2, hold=1.2)
    assert found.fit.status is FitStatus.CONVERGED
    pressures = np.array([SPLIT.pressures(d) for d in (5e4, 3e4, 7e4)])
    angles = rest_angles(rig, pressures, np.full(3, 1.2))
    assert found.point.angle == pytest.approx(angles[0], abs=1e-4)
    assert found.model.gain == pytest.approx((angles[2] - angles[1]) / 4e4, rel=0.05)
