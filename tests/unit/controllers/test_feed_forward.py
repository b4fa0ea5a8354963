"""Feed-forward: what it gives, how it looks ahead, and that undone hysteresis is undone."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

import pamsim
from pamsim.controllers.cascade import regulated_lag
from pamsim.controllers.feed_forward import FeedForward, balanced_pressures, shut_stiffness
from pamsim.controllers.hysteresis import decaying_triangle, loop_operator
from pamsim.controllers.pid import Pid
from pamsim.physics.hysteresis.prandtl_ishlinskii import PlaySum
from tests.unit.controllers.closed_loop import (
    LEVEL,
    PERIOD,
    SPLIT,
    SUPPLY,
    miss,
    observe,
    run,
    sine,
)

PID = Pid(
    split=SPLIT,
    period=PERIOD,
    gain=4e5,
    integral_time=0.2,
    derivative_time=0.1,
    filter_time=0.01,
    rate_weight=1.0,
    tracking_time=0.5,
)


@pytest.fixture(scope="module")
def strong(rig):
    """Ten times the default hysteresis: 20 N/bar."""
    return rig.with_parameters({"hysteresis.force_per_pressure": 2e-4})


@pytest.fixture(scope="module")
def forward(rig):
    return FeedForward.for_rig(rig, load=1.2, common_pressure=LEVEL)


def test_the_lead_is_the_lag_of_the_pressure_along_the_motion(forward):
    assert forward.lead == regulated_lag(forward.arm.pair[0], LEVEL)
    lead = forward.lead
    later = (0.2 + 0.5 * lead + 4.0 * lead**2, 0.5 + 8.0 * lead, 8.0)
    leading, _ = forward.step(observe(wanted=(0.2, 0.5, 8.0)), forward.start(observe()))
    there = dataclasses.replace(forward, lead=0.0)
    assert leading == pytest.approx(there.step(observe(wanted=later), there.start(observe()))[0])
    torque = forward.arm.muscle_torque(*later)
    assert leading == pytest.approx(balanced_pressures(forward.arm, later[0], torque, LEVEL))


def test_a_stiffness_asked_for_replaces_the_common_pressure(forward):
    observation = observe(wanted=(0.2, 0.0, 0.0), stiffness=14.0)
    command, _ = forward.step(observation, forward.start(observation))
    assert shut_stiffness(forward.arm, 0.2, command) == pytest.approx(14.0, rel=1e-6)


def test_feedback_adds_its_difference_and_leaves_the_mean(forward):
    both = dataclasses.replace(forward, feedback=PID)
    observation = observe(angle=0.15, wanted=(0.2, 0.0, 0.0))
    alone, _ = forward.step(observation, forward.start(observation))
    helped, memory = both.step(observation, both.start(observation))
    assert sum(helped) == pytest.approx(sum(alone))
    assert (helped[0] - helped[1]) - (alone[0] - alone[1]) == pytest.approx(0.05 * PID.gain)
    assert memory.feedback.integral == pytest.approx(0.05 * PID.gain * PERIOD / 0.2)


def test_feedback_knows_the_limited_difference(forward):
    both = dataclasses.replace(forward, feedback=PID)
    memory, integrals = both.start(observe()), []
    for _ in range(400):
        _, memory = both.step(observe(angle=-3.0, wanted=(0.5, 0.0, 0.0)), memory)
        integrals.append(memory.feedback.integral)
    assert max(map(abs, integrals)) < 5.0 * SUPPLY
    assert integrals[-1] == pytest.approx(integrals[-2])


def test_the_way_to_the_first_angle_is_remembered(forward):
    lagging = PlaySum(linear=0.4, thresholds=(0.02, 0.1), weights=(0.3, 0.2))
    undoing = dataclasses.replace(forward, hysteresis=lagging.inverse())
    observation = observe(wanted=(0.1, 0.0, 0.0))
    back, fresh = (
        undoing.step(observation, undoing.start(observe(angle=angle)))[0] for angle in (0.3, 0.0)
    )
    assert back[0] - back[1] < fresh[0] - fresh[1] - 1e3
    # An operator without plays changes nothing.
    idle = PlaySum(linear=1.0, thresholds=(), weights=()).inverse()
    same = dataclasses.replace(forward, hysteresis=idle)
    one, other = (each.step(observation, each.start(observation))[0] for each in (same, forward))
    assert one == other


def test_undone_hysteresis_is_undone(strong):
    """The operator is fitted to one recording; the sine is another."""
    triangle = decaying_triangle(SPLIT, amplitude=1.2e5, load=1.2, periods=3)
    found = loop_operator(strong, pamsim.simulate(strong, triangle).completed())
    assert found.rms < math.radians(0.3)
    wanted = sine(0.2, 10.0)
    plain = FeedForward.for_rig(strong, load=1.2, common_pressure=LEVEL)
    undoing = dataclasses.replace(plain, hysteresis=found.operator.inverse())
    without, compensated = (
        miss(run(strong, item, wanted, 7.5), after=2.5) for item in (plain, undoing)
    )
    assert without > math.radians(3.0)
    assert compensated < 0.2 * without


def test_feedback_and_law_together_beat_either(rig, forward):
    both = dataclasses.replace(forward, feedback=PID)
    alone = dataclasses.replace(PID, rate_weight=0.0)
    missed = [
        miss(run(rig, item, sine(0.5, 10.0), 4.0), after=2.0) for item in (both, forward, alone)
    ]
    assert missed[0] < 0.5 * min(missed[1:])


def test_the_triangle_shrinks_and_starts_at_equal_pressures():
    triangle = decaying_triangle(SPLIT, amplitude=1e5, period=4.0, periods=3, shrink=0.5)
    difference = triangle.command_value[:, 0] - triangle.command_value[:, 1]
    peaks = [np.ptp(difference[k * 80 : (k + 1) * 80]) for k in range(3)]
    assert peaks == pytest.approx([2e5, 1e5, 0.5e5])
    assert triangle.start_pressure == pytest.approx((LEVEL, LEVEL))
    assert triangle.command_value.sum(axis=1) == pytest.approx(2.0 * LEVEL)
