"""A chain that gives, in the engine: where the arm rests and what the chain costs it."""

from __future__ import annotations

import sys
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from scipy.optimize import brentq

import pamsim
from tests.plant.muscle import steady_pull
from tests.plant.read_rig import read_rig
from tests.unit.physics.flat import EXTENSION

COMPLIANCE = 2e-6
LOAD = 1.2
PRESSURES = 4.2e5, 1.1e5
NO_LOOP = {"hysteresis.force_per_pressure": 0.0}
STEP = pamsim.pressure_step((3e5, 3e5), (4.5e5, 1e5), duration=0.6, load=LOAD, sample_rate=100.0)


def rig_with(compliance, relaxation=0.01, **changes):
    chain = {"chain.compliance": compliance, "chain.relaxation_time": relaxation}
    return pamsim.load_rig("mas20_arm").with_parameters(chain | changes)


def balanced_tension(m, length, pressure):
    """Root of T = F(l - C T) for a muscle that would have a length on a rigid chain."""

    def short(tension):
        return max(steady_pull(m, length - m.compliance * tension, pressure), 0.0) - tension

    return brentq(short, 0.0, steady_pull(m, length, pressure), xtol=1e-10)


def balance(plant):
    """Angle and tensions at which the static torques of chains and load cancel."""
    joint = plant.joint[0]

    def tensions(angle):
        return [
            balanced_tension(m, m.length_at_zero + m.arm * angle, pressure)
            for m, pressure in zip(plant.muscles, PRESSURES, strict=True)
        ]

    def torque(angle):
        pulls = sum(-m.arm * t for m, t in zip(plant.muscles, tensions(angle), strict=True))
        return pulls + joint.weight_cos * np.cos(angle) + joint.weight_sin * np.sin(angle)

    angle = brentq(torque, -0.5, 0.9, xtol=1e-13)
    return angle, np.array(tensions(angle))


@pytest.mark.parametrize("relaxation", [4e-3, 0.05])
def test_the_arm_rests_where_the_static_balance_says_whatever_the_time_constant(relaxation):
    rig = rig_with(COMPLIANCE, relaxation, **NO_LOOP)
    model = rig.model_for(load=LOAD, command="pressure_set")
    data = mujoco.MjData(model)
    pamsim.reset(model, data, PRESSURES)
    data.ctrl[:] = PRESSURES
    with pamsim.live(model):
        mujoco.mj_step(model, data, round(12.0 / model.opt.timestep))
        mujoco.mj_forward(model, data)
    angle, tensions = balance(read_rig(rig, LOAD))
    rigid, _ = balance(read_rig(rig_with(0.0, **NO_LOOP), LOAD))
    assert abs(angle - rigid) > np.radians(1.0), "the chain must matter"
    assert data.qpos[0] == pytest.approx(angle, abs=1e-8)
    np.testing.assert_allclose(-data.actuator_force, tensions, rtol=1e-7)
    extensions = data.act[model.actuator_actadr + model.actuator_actnum - EXTENSION]
    np.testing.assert_allclose(extensions, COMPLIANCE * tensions, rtol=1e-7)


def test_callbacks_agree_with_a_chain_that_gives():
    rig = rig_with(COMPLIANCE)
    brief = replace(STEP, settle=0.1)  # the interpreted kernel is slow
    fast = pamsim.simulate(rig, brief).completed()
    slow = pamsim.simulate(rig, brief, backend="python").completed()
    for name in ("angle", "velocity", "pressure", "tension"):
        np.testing.assert_allclose(getattr(fast, name), getattr(slow, name), rtol=1e-9, atol=1e-12)
    if sys.platform == "linux":  # there, machine code and interpreter call one mathematics library
        assert np.array_equal(fast.final_state, slow.final_state)


def test_a_rigid_chain_leaves_no_trace_whatever_its_time_constant():
    quick, slow = (pamsim.simulate(rig_with(0.0, tau), STEP).completed() for tau in (1e-3, 10.0))
    for name in ("angle", "velocity", "pressure", "tension", "final_state"):
        assert np.array_equal(getattr(quick, name), getattr(slow, name)), name


def test_a_stiff_chain_tends_to_the_rigid_one():
    """The path differs in proportion to the compliance."""
    rigid, half, whole = (
        pamsim.simulate(rig_with(c), STEP).completed() for c in (0.0, 0.5e-8, 1e-8)
    )
    near, far = half.angle - rigid.angle, whole.angle - rigid.angle
    assert np.abs(near).max() < np.radians(0.02)
    np.testing.assert_allclose(far, 2.0 * near, atol=0.02 * np.abs(far).max())


def swing(compliance):
    """Turning points [rad] of an arm without friction that is let go between two shut muscles."""
    rig = rig_with(
        compliance, 0.05, **NO_LOOP, **{"joint.shaft.damping": 0.0, "body.rig.tilt": 0.0}
    )
    model = rig.model_for(load=LOAD, command="valve", timestep=2e-4)
    data = mujoco.MjData(model)
    pamsim.reset(model, data, (2e5, 2e5))
    data.qpos[0] = 0.15
    angles = []
    with pamsim.live(model):
        for _ in range(10000):
            mujoco.mj_step(model, data)
            angles.append(float(data.qpos[0]))
    path = np.array(angles)
    turns = np.flatnonzero(np.diff(np.sign(np.diff(path)))) + 1
    return np.abs(path[turns])


def test_shut_muscles_keep_an_arm_swinging_and_their_chains_bring_it_to_rest():
    rigid, chained = swing(0.0), swing(COMPLIANCE)
    assert len(rigid) > 6
    assert np.ptp(rigid) < 1e-4 * rigid[0]
    assert len(chained) > 6
    assert np.all(np.diff(chained) < 0.0)
    assert chained[-1] < 0.8 * rigid[-1]
