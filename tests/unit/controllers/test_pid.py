"""PID: rest, jumps of the reference, and how it comes back from the limits."""

from __future__ import annotations

import dataclasses
import math

import pytest

from pamsim.controllers.pid import Pid
from pamsim.core.errors import InputError
from tests.unit.controllers.closed_loop import LEVEL, PERIOD, SPLIT, observe

PI = Pid(split=SPLIT, period=PERIOD, gain=2e6, integral_time=0.5, tracking_time=0.2)
LAG, GAIN = 0.5, 1e-6  # of a plant T y' = K dp - y [s, rad/Pa]


def lagged(pid, wanted, samples, angle, memory):
    """Angle after some samples on the lag, with the memory there."""
    keep = math.exp(-PERIOD / LAG)
    for _ in range(samples):
        observation = observe(angle=angle, wanted=(wanted, 0.0, 0.0))
        (first, second), memory = pid.step(observation, memory)
        angle = keep * angle + (1.0 - keep) * GAIN * (first - second)
    return angle, memory


def after_saturation(pid):
    """Angle one time constant after an unreachable reference came back into reach."""
    reach = 2.0 * LEVEL * GAIN
    angle, memory = lagged(pid, 2.0 * reach, 500, 0.0, pid.start(observe()))
    assert angle == pytest.approx(reach, rel=1e-3)
    angle, _ = lagged(pid, 0.2 * reach, round(LAG / PERIOD), angle, memory)
    return angle / reach


def test_it_recovers_within_a_time_constant_where_plain_integration_stays_at_the_limit():
    assert abs(after_saturation(PI) - 0.2) < 0.2 * 0.8
    assert after_saturation(dataclasses.replace(PI, tracking_time=math.inf)) > 0.99


def test_the_integral_takes_the_offset():
    angle, _ = lagged(PI, 0.3, 500, 0.0, PI.start(observe()))
    assert angle == pytest.approx(0.3, abs=1e-6)
    proportional = dataclasses.replace(PI, integral_time=math.inf)
    angle, _ = lagged(proportional, 0.3, 500, 0.0, proportional.start(observe()))
    assert angle == pytest.approx(0.3 * PI.gain * GAIN / (1.0 + PI.gain * GAIN), rel=1e-6)


def test_at_rest_it_keeps_the_pressures_there_are():
    observation = observe(angle=0.2, pressure=(4e5, 2e5), wanted=(0.2, 0.0, 0.0))
    command, _ = PI.step(observation, PI.start(observation))
    assert command == pytest.approx((4e5, 2e5))


def test_a_jump_of_the_reference_kicks_by_the_gain_alone():
    pid = dataclasses.replace(PI, derivative_time=0.3, filter_time=0.01)
    command, _ = pid.step(observe(wanted=(0.01, 0.0, 0.0)), pid.start(observe()))
    assert command[0] - command[1] == pytest.approx(0.01 * pid.gain)


@pytest.mark.parametrize("weight", [0.0, 1.0])
def test_the_derivative_brakes_what_the_weight_leaves_of_the_wanted_rate(weight):
    pid = dataclasses.replace(PI, derivative_time=0.3, rate_weight=weight)
    # At the next sample the reference is one period further: no error at this one.
    observation = observe(velocity=0.5, wanted=(0.5 * PERIOD, 0.5, 0.0))
    command, _ = pid.step(observation, pid.start(observe()))
    braked = -pid.gain * 0.3 * 0.5 * (1.0 - weight)
    assert command[0] - command[1] == pytest.approx(braked, abs=1e-6)


def test_the_rate_comes_through_a_lag():
    pid = dataclasses.replace(PI, integral_time=math.inf, derivative_time=0.1, filter_time=0.1)
    memory, rates = pid.start(observe()), []
    for _ in range(6):
        _, memory = pid.step(observe(velocity=1.0), memory)
        rates.append(1.0 - memory.rate)
    left = pid.filter_time / (pid.filter_time + PERIOD)
    assert rates == pytest.approx([left ** (k + 1) for k in range(6)])


def test_times_it_cannot_take_are_refused():
    for bad in (
        {"period": 0.0},
        {"integral_time": 0.0},
        {"derivative_time": -1.0},
        {"tracking_time": 0.5 * PERIOD},
    ):
        with pytest.raises(InputError, match=next(iter(bad))):
            dataclasses.replace(PI, **bad)
