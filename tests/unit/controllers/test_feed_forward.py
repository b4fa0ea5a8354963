"""The inverse force law against the engine, feed-forward by it, and hysteresis that is undone."""

import copy
import dataclasses
import math

import mujoco
import numpy as np
import pytest

import pamsim
from pamsim.controllers.cascade import regulated_lag
from pamsim.controllers.feed_forward import (
    Arm,
    FeedForward,
    balanced_pressures,
    shut_stiffness,
    stiff_pressures,
)
from pamsim.controllers.hysteresis import decaying_triangle, identify_play_sum, loop_operator
from pamsim.controllers.pid import Pid
from pamsim.engine.equilibrium import rest_angles
from pamsim.engine.state import charge, reset
from pamsim.physics.hysteresis.prandtl_ishlinskii import PlaySum
from pamsim.recordings.excitation import triangle
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
from tests.unit.core.refusals import all_refused, refused


def test_the_arm_rests_at_the_angle_asked_for(rig):
    angles = np.radians(np.linspace(-33.0, 33.0, 7))
    for load, common in ((0.0, 2e5), (1.2, 3e5), (1.2, 4e5)):
        arm = Arm.for_rig(rig, load=load)
        pressures = np.array(
            [balanced_pressures(arm, b, arm.muscle_torque(b), common) for b in angles.tolist()]
        )
        np.testing.assert_allclose(pressures.sum(axis=1), 2.0 * common)
        found = rest_angles(rig, pressures, np.full(angles.size, load))
        np.testing.assert_allclose(found, angles, atol=1e-6)
    arm = Arm.for_rig(rig)  # out of reach it gives what comes nearest
    assert balanced_pressures(arm, 0.0, 1e3, 3e5) == (arm.supply, 0.0)
    assert balanced_pressures(arm, 0.0, -1e3, 3e5) == (0.0, arm.supply)
    soft, hard = (stiff_pressures(arm, 0.2, 0.0, far) for far in (0.0, 1e3))
    assert (min(soft), max(hard)) == (0.0, arm.supply)
    with refused("tendons"):
        Arm.for_rig(rig.with_parameters({"tendon.chain_2.coef": 0.013}))


def test_a_pair_that_p1_less_p2_does_not_turn_to_positive_angles_is_refused(rig, tmp_path):
    turned = dataclasses.replace(rig, model=copy.copy(rig.model))
    turned.model.wrap_prm *= -1.0
    bellows = pamsim.load_rig(pamsim.new_rig("pair", kind="bellows", out=tmp_path / "pair"))
    all_refused({"turned": (turned, "positive"), "bellows": (bellows, "pull")}, Arm.for_rig)


@pytest.mark.parametrize("gravity", [(0.0, 0.0, -9.81), (2.0, -3.0, 4.0)])
def test_the_engine_accelerates_as_asked(rig, gravity):
    there = dataclasses.replace(rig, model=copy.copy(rig.model))
    there.model.opt.gravity = gravity
    there.model.jnt_stiffness[0] = 2.0
    arm = Arm.for_rig(there, load=0.7)
    model = there.model_for(load=0.7)
    data = mujoco.MjData(model)
    with pamsim.live(model):
        for angle, rate, acceleration in ((0.2, 1.5, 8.0), (-0.3, -2.0, 3.0), (0.1, 0.0, -9.0)):
            torque = arm.muscle_torque(angle, rate, acceleration)
            pressures = balanced_pressures(arm, angle, torque, 3e5)
            reset(model, data)
            data.qpos[0], data.qvel[0] = angle, rate
            charge(model, data, pressures)
            mujoco.mj_forward(model, data)
            assert data.qacc[0] == pytest.approx(acceleration, abs=1e-5)
    # Dry friction is overcome the way the arm moves.
    plain, dry = (
        Arm.for_rig(rig),
        Arm.for_rig(rig.with_parameters({"joint.shaft.frictionloss": 0.4})),
    )
    for rate, sign in ((1.0, 1.0), (-1.0, -1.0), (0.0, 0.0)):
        added = dry.muscle_torque(0.1, rate) - plain.muscle_torque(0.1, rate)
        assert added == pytest.approx(0.4 * sign)


def test_stiffness_asked_is_stiffness_got(rig):
    arm = Arm.for_rig(rig, load=1.2)
    for angle in (-0.3, 0.0, 0.25):
        torque = arm.muscle_torque(angle)
        # Where both pull: the stiffness jumps at the pressure at which one goes slack.
        both = balanced_pressures(arm, angle, torque, 2e5), stiff_pressures(arm, angle, torque, 1e3)
        low, high = (shut_stiffness(arm, angle, pressures) for pressures in both)
        for share in (0.05, 0.5, 0.95):
            wanted = low + share * (high - low)
            pressures = stiff_pressures(arm, angle, torque, wanted)
            assert shut_stiffness(arm, angle, pressures) == pytest.approx(wanted, rel=1e-6)
            found = rest_angles(rig, np.array([pressures]), np.array([1.2]))
            assert found[0] == pytest.approx(angle, abs=1e-6)


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
def forward(rig):
    return FeedForward.for_rig(rig, load=1.2, common_pressure=LEVEL)


def first_command(controller, start=None, **seen):
    return controller.step(observe(**seen), controller.start(start or observe(**seen)))[0]


def test_the_lead_is_the_lag_of_the_pressure_along_the_motion(rig, forward):
    lead = forward.lead
    assert lead == regulated_lag(forward.arm.pair[0], 0.0, LEVEL)
    late = FeedForward.for_rig(
        rig.with_parameters({"valve.delay": 0.05}), load=1.2, common_pressure=LEVEL
    )
    assert late.lead == pytest.approx(lead + 0.05)
    later = (0.2 + 0.5 * lead + 4.0 * lead**2, 0.5 + 8.0 * lead, 8.0)
    leading = first_command(forward, wanted=(0.2, 0.5, 8.0))
    there = dataclasses.replace(forward, lead=0.0)
    assert leading == pytest.approx(first_command(there, wanted=later))
    torque = forward.arm.muscle_torque(*later)
    assert leading == pytest.approx(balanced_pressures(forward.arm, later[0], torque, LEVEL))
    # A stiffness asked for replaces the common pressure.
    stiff = first_command(forward, wanted=(0.2, 0.0, 0.0), stiffness=14.0)
    assert shut_stiffness(forward.arm, 0.2, stiff) == pytest.approx(14.0, rel=1e-6)


def test_feedback_adds_its_difference_leaves_the_mean_and_knows_the_limits(forward):
    both = dataclasses.replace(forward, feedback=PID)
    observation = observe(angle=0.15, wanted=(0.2, 0.0, 0.0))
    alone, _ = forward.step(observation, forward.start(observation))
    helped, memory = both.step(observation, both.start(observation))
    assert sum(helped) == pytest.approx(sum(alone))
    assert (helped[0] - helped[1]) - (alone[0] - alone[1]) == pytest.approx(0.05 * PID.gain)
    assert memory.feedback.integral == pytest.approx(0.05 * PID.gain * PERIOD / 0.2)
    memory, integrals = both.start(observe()), []
    for _ in range(400):
        _, memory = both.step(observe(angle=-3.0, wanted=(0.5, 0.0, 0.0)), memory)
        integrals.append(memory.feedback.integral)
    assert max(map(abs, integrals)) < 5.0 * SUPPLY
    assert integrals[-1] == pytest.approx(integrals[-2])


def test_the_way_to_the_first_angle_is_remembered(forward):
    lagging = PlaySum(linear=0.4, thresholds=(0.02, 0.1), weights=(0.3, 0.2))
    undoing = dataclasses.replace(forward, hysteresis=lagging.inverse())
    wanted = {"wanted": (0.1, 0.0, 0.0)}
    back, fresh = (
        first_command(undoing, start=observe(angle=angle), **wanted) for angle in (0.3, 0.0)
    )
    assert back[0] - back[1] < fresh[0] - fresh[1] - 1e3
    # An operator without plays changes nothing.
    idle = PlaySum(linear=1.0, thresholds=(), weights=()).inverse()
    same = dataclasses.replace(forward, hysteresis=idle)
    assert first_command(same, **wanted) == first_command(forward, **wanted)


def test_undone_hysteresis_is_undone(rig):
    """The operator is fitted to one recording; the sine is another."""
    strong = rig.with_parameters({"hysteresis.force_per_pressure": 2e-4})  # 20 N/bar: ten times
    recorded = decaying_triangle(SPLIT, amplitude=1.2e5, load=1.2, periods=3)
    found = loop_operator(strong, pamsim.simulate(strong, recorded).completed())
    assert found.rms < math.radians(0.3)
    plain = FeedForward.for_rig(strong, load=1.2, common_pressure=LEVEL)
    undoing = dataclasses.replace(plain, hysteresis=found.operator.inverse())
    without, compensated = (
        miss(run(strong, item, sine(0.2, 10.0), 7.5), after=2.5) for item in (plain, undoing)
    )
    assert without > math.radians(3.0)
    assert compensated < 0.2 * without
    # The triangle shrinks and starts at equal pressures.
    wave = decaying_triangle(SPLIT, amplitude=1e5, period=4.0, periods=3, shrink=0.5)
    difference = wave.command_value[:, 0] - wave.command_value[:, 1]
    peaks = [np.ptp(difference[k * 80 : (k + 1) * 80]) for k in range(3)]
    assert peaks == pytest.approx([2e5, 1e5, 0.5e5])
    assert wave.start_pressure == pytest.approx((LEVEL, LEVEL))
    assert wave.command_value.sum(axis=1) == pytest.approx(2.0 * LEVEL)


INPUT = 0.4 * triangle(np.linspace(0.0, 6.0, 1200), 1.0, 0.75)
LARGEST = float(np.max(np.abs(INPUT)))
PLANTED = PlaySum(
    linear=0.6,
    thresholds=tuple(LARGEST * (k + 0.5) / 8 for k in (0, 2, 5)),
    weights=(0.3, 0.15, 0.2),
)


def through(operator, values):
    memory, found = operator.virgin(), []
    for x in values:
        memory, y = operator.step(memory, float(x))
        found.append(y)
    return np.array(found)


def test_planted_plays_come_back_and_their_inverse_undoes_the_loop():
    found = identify_play_sum(INPUT, through(PLANTED, INPUT), plays=8)
    assert found.operator.linear == pytest.approx(PLANTED.linear, abs=1e-9)
    assert found.operator.thresholds == pytest.approx(PLANTED.thresholds)
    assert found.operator.weights == pytest.approx(PLANTED.weights, abs=1e-9)
    assert found.rms < 1e-12
    noise = 2e-3 * np.random.default_rng(3).standard_normal(INPUT.size)
    found = identify_play_sum(INPUT, through(PLANTED, INPUT) + noise, plays=8)
    assert found.rms == pytest.approx(2e-3, rel=0.1)
    unseen = 0.3 * np.sin(np.linspace(0.0, 20.0, 700)) * np.cos(np.linspace(0.0, 3.0, 700))
    inverse = found.operator.inverse()
    back = through(inverse, through(found.operator, unseen))
    np.testing.assert_allclose(back, unseen, atol=1e-12)
    real = through(PLANTED, unseen)
    lag = np.max(np.abs(real - unseen))
    assert np.max(np.abs(through(inverse, real) - unseen)) < 0.05 * lag


def test_a_loop_that_leads_gets_no_plays_and_what_has_no_inverse_is_refused():
    leading = PlaySum(linear=2.0, thresholds=(0.1,), weights=(-1.0,))
    found = identify_play_sum(INPUT, through(leading, INPUT), plays=8)
    assert found.operator.weights == ()
    undone = through(found.operator.inverse(), found.operator.linear * INPUT)
    assert undone == pytest.approx(INPUT)
    bad = {
        "still": (np.zeros(9), np.zeros(9), "stays at 0"),
        "lengths": (INPUT, INPUT[1:], "one for each"),
        "falling": (INPUT, -INPUT, "no inverse"),
    }
    all_refused(bad, identify_play_sum)
