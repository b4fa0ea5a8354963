"""The inverse force law against the engine: rest, motion, stiffness, what is out of reach."""

from __future__ import annotations

import copy
import dataclasses

import mujoco
import numpy as np
import pytest

import pamsim
from pamsim.controllers.feed_forward import Arm, balanced_pressures, shut_stiffness, stiff_pressures
from pamsim.core.errors import InputError
from pamsim.engine.equilibrium import rest_angles
from pamsim.engine.state import charge, reset


@pytest.mark.parametrize("load", [0.0, 1.2])
@pytest.mark.parametrize("common", [2e5, 3e5, 4e5])
def test_the_arm_rests_at_the_angle_asked_for(rig, load, common):
    arm = Arm.for_rig(rig, load=load)
    angles = np.radians(np.linspace(-33.0, 33.0, 7))
    pressures = np.array(
        [balanced_pressures(arm, b, arm.muscle_torque(b), common) for b in angles.tolist()]
    )
    np.testing.assert_allclose(pressures.sum(axis=1), 2.0 * common)
    found = rest_angles(rig, pressures, np.full(angles.size, load))
    np.testing.assert_allclose(found, angles, atol=1e-6)


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


def test_dry_friction_is_overcome_the_way_the_arm_moves(rig):
    plain, dry = (
        Arm.for_rig(there)
        for there in (rig, rig.with_parameters({"joint.shaft.frictionloss": 0.4}))
    )
    for rate, sign in ((1.0, 1.0), (-1.0, -1.0), (0.0, 0.0)):
        added = dry.muscle_torque(0.1, rate) - plain.muscle_torque(0.1, rate)
        assert added == pytest.approx(0.4 * sign)


@pytest.mark.parametrize("angle", [-0.3, 0.0, 0.25])
def test_stiffness_asked_is_stiffness_got(rig, angle):
    arm = Arm.for_rig(rig, load=1.2)
    torque = arm.muscle_torque(angle)
    # Where both muscles pull: the stiffness jumps at the pressure at which one goes slack.
    both = (balanced_pressures(arm, angle, torque, 2e5), stiff_pressures(arm, angle, torque, 1e3))
    ends = [shut_stiffness(arm, angle, pressures) for pressures in both]
    for share in (0.05, 0.5, 0.95):
        wanted = ends[0] + share * (ends[1] - ends[0])
        pressures = stiff_pressures(arm, angle, torque, wanted)
        assert shut_stiffness(arm, angle, pressures) == pytest.approx(wanted, rel=1e-6)
        found = rest_angles(rig, np.array([pressures]), np.array([1.2]))
        assert found[0] == pytest.approx(angle, abs=1e-6)


def test_out_of_reach_it_gives_what_comes_nearest(rig):
    arm = Arm.for_rig(rig)
    assert balanced_pressures(arm, 0.0, 1e3, 3e5) == (arm.supply, 0.0)
    assert balanced_pressures(arm, 0.0, -1e3, 3e5) == (0.0, arm.supply)
    soft, hard = (stiff_pressures(arm, 0.2, 0.0, far) for far in (0.0, 1e3))
    assert min(soft) == 0.0
    assert max(hard) == arm.supply


def test_an_arm_that_is_no_sprocket_between_two_chains_is_refused(rig):
    with pytest.raises(InputError, match="tendons"):
        Arm.for_rig(rig.with_parameters({"tendon.chain_2.coef": 0.013}))
