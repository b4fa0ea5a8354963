"""Control of several joints: pressures from the rig's own statics, PIDs that find the rest."""

import dataclasses
import math
from contextlib import closing

import gymnasium
import numpy as np
import pytest

import pamsim
from pamsim.controllers.controller import JointObservation, Observation
from pamsim.controllers.joint_control import InverseStatics, JointControl
from pamsim.controllers.pid import PidLaw
from pamsim.controllers.suite import Suite
from pamsim.engine.equilibrium import rest_positions
from pamsim.envs.closed_loop import run_episode
from tests.unit.core.refusals import all_refused, refused

TWO = pamsim.load_rig("two_joint_arm")


def test_pressures_of_a_position_are_those_at_which_the_rig_rests_there():
    statics = InverseStatics(TWO, 0.0, 300e3)
    wanted = np.array([0.3, -0.4])
    pressure = statics.pressures(wanted.tolist(), np.zeros(2))
    assert rest_positions(TWO, pressure, np.zeros(2)) == pytest.approx(wanted, abs=2e-3)
    assert 0.0 < pressure.min() < pressure.max() < 600e3
    # A torque beside it is what is left over there, and stiffness is its fall.
    turned = statics.pressures(wanted.tolist(), np.array([0.5, -0.2]))
    assert statics.torques(wanted.tolist(), turned) == pytest.approx([0.5, -0.2], abs=0.02)
    near = np.array([1e-3, 0.0])
    fall = statics.torques(wanted + near, statics.common) - statics.torques(wanted, statics.common)
    assert statics.stiffness(wanted.tolist())[0] == pytest.approx(-fall[0] / 1e-3, rel=0.02)
    pressure = statics.pressures([0.0, 0.0], np.array([1e3, 1e3]))  # out of reach
    assert pressure == pytest.approx([600e3, 0.0, 600e3, 0.0], abs=1.0)


@pytest.mark.parametrize(("name", "seed"), [("two_joint_arm", 0), ("mas20_arm", 1)])
def test_every_joint_comes_to_the_position_wanted(name, seed):
    control = JointControl.for_rig(pamsim.load_rig(name), closed_loop_time=0.1)
    options = {"rig": name, "task": "regulation", "max_episode_steps": 200}
    with closing(gymnasium.make("pamsim/Rig-v0", **options)) as env:
        run = run_episode(env, control, seed=seed)
    assert np.abs(run.reference[0]).max() > math.radians(3.0)
    assert np.degrees(np.abs(run.position[-5:] - run.reference[-5:]).max()) < 0.2


def test_a_delay_of_the_valves_is_a_dead_time_of_the_design():
    late = JointControl.for_rig(TWO.with_parameters({"valve.delay": 0.05}), closed_loop_time=0.1)
    slow = JointControl.for_rig(TWO, closed_loop_time=0.15)
    assert [law.gain for law in late.laws] == pytest.approx([law.gain for law in slow.laws])


def test_memory_goes_in_and_out():
    control = JointControl.for_rig(TWO, closed_loop_time=0.2)
    joint = JointObservation(position=0.1, velocity=0.0, reference=0.2)
    seen = Observation(time=0.0, joints=(joint,) * 2, pressure=(3e5,) * 4)
    memory = control.start(seen)
    first, later = control.step(seen, memory)
    assert control.step(seen, memory) == (first, later)
    assert later != memory
    assert all(0.0 <= value <= 600e3 for value in first)
    idle = dataclasses.replace(control, laws=(PidLaw(period=0.02, gain=0.0),) * 2)
    held = control.statics.pressures([0.2, 0.2], np.zeros(2))
    assert idle.step(seen, memory)[0] == pytest.approx(held)


def test_controllers_of_another_rig_say_so_in_one_line():
    arm = pamsim.load_rig("mas20_arm")
    with closing(gymnasium.make("pamsim/Rig-v0", rig="two_joint_arm")) as env:
        bad = {
            "arm": (Suite(rig=arm).feed_forward(), "one joint"),
            "joints": (JointControl.for_rig(arm, closed_loop_time=0.1), "1 joints"),
        }
        all_refused(bad, lambda control: run_episode(env, control, seed=0))
    with refused("one joint"):
        Suite(rig=TWO)
    with refused("common pressure"):
        InverseStatics(TWO, 0.0, 900e3)
