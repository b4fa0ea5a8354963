"""Control of several joints: pressures from the rig's own statics, PIDs that find the rest."""

from __future__ import annotations

import dataclasses
import math

import gymnasium
import numpy as np
import pytest

import pamsim
from pamsim.controllers.controller import JointObservation, Observation
from pamsim.controllers.joint_control import InverseStatics, JointControl
from pamsim.controllers.pid import PidLaw
from pamsim.controllers.suite import Suite
from pamsim.core.errors import InputError
from pamsim.engine.equilibrium import rest_positions
from pamsim.envs.closed_loop import run_episode


@pytest.fixture(scope="module")
def rig():
    return pamsim.load_rig("two_joint_arm")


def test_pressures_of_a_position_are_those_at_which_the_rig_rests_there(rig):
    statics = InverseStatics(rig, 0.0, 300e3)
    wanted = np.array([0.3, -0.4])
    pressure = statics.pressures(wanted.tolist(), np.zeros(2))
    assert rest_positions(rig, pressure, np.zeros(2)) == pytest.approx(wanted, abs=2e-3)
    assert pressure.min() > 0.0
    assert pressure.max() < 600e3
    # A torque beside it is what is left over there, and stiffness is its fall.
    turned = statics.pressures(wanted.tolist(), np.array([0.5, -0.2]))
    assert statics.torques(wanted.tolist(), turned) == pytest.approx([0.5, -0.2], abs=0.02)
    near = np.array([1e-3, 0.0])
    fall = statics.torques(wanted + near, statics.common) - statics.torques(wanted, statics.common)
    assert statics.stiffness(wanted.tolist())[0] == pytest.approx(-fall[0] / 1e-3, rel=0.02)


def test_what_is_out_of_reach_ends_at_the_limits(rig):
    statics = InverseStatics(rig, 0.0, 300e3)
    pressure = statics.pressures([0.0, 0.0], np.array([1e3, 1e3]))
    assert pressure == pytest.approx([600e3, 0.0, 600e3, 0.0], abs=1.0)


@pytest.mark.parametrize(("name", "seed"), [("two_joint_arm", 0), ("mas20_arm", 1)])
def test_every_joint_comes_to_the_position_wanted(name, seed):
    loaded = pamsim.load_rig(name)
    control = JointControl.for_rig(loaded, closed_loop_time=0.1)
    env = gymnasium.make("pamsim/Rig-v0", rig=name, task="regulation", max_episode_steps=200)
    run = run_episode(env, control, seed=seed)
    env.close()
    assert np.abs(run.reference[0]).max() > math.radians(3.0)
    assert np.degrees(np.abs(run.position[-5:] - run.reference[-5:]).max()) < 0.2


def test_memory_goes_in_and_out(rig):
    control = JointControl.for_rig(rig, closed_loop_time=0.2)
    seen = Observation(
        time=0.0,
        joints=(JointObservation(position=0.1, velocity=0.0, reference=0.2),) * 2,
        pressure=(3e5,) * 4,
    )
    memory = control.start(seen)
    first, later = control.step(seen, memory)
    assert control.step(seen, memory) == (first, later)
    assert later != memory
    assert all(0.0 <= value <= 600e3 for value in first)
    idle = dataclasses.replace(control, laws=(PidLaw(period=0.02, gain=0.0),) * 2)
    held = control.statics.pressures([0.2, 0.2], np.zeros(2))
    assert idle.step(seen, memory)[0] == pytest.approx(held)


def test_controllers_of_another_rig_say_so_in_one_line(rig):
    env = gymnasium.make("pamsim/Rig-v0", rig="two_joint_arm")
    arm = pamsim.load_rig("mas20_arm")
    for control, message in (
        (Suite(rig=arm).feed_forward(), "one joint"),
        (JointControl.for_rig(arm, closed_loop_time=0.1), "1 joints"),
    ):
        with pytest.raises(InputError, match=message) as caught:
            run_episode(env, control, seed=0)
        assert "\n" not in str(caught.value)
    env.close()
    with pytest.raises(InputError, match="one joint") as caught:
        Suite(rig=rig)
    assert "\n" not in str(caught.value)
    with pytest.raises(InputError, match="common pressure"):
        InverseStatics(rig, 0.0, 900e3)
