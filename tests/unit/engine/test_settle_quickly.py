"""Rest in longer time steps is the same rest, and never a rig that broke down."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

import pamsim
from pamsim.engine.state import settle, settle_quickly
from pamsim.engine.stepping import live


def at_rest(rig, steps):
    """Position, velocity and time step after settling; by `settle` itself for 0 steps."""
    pressures = (2.4e5, *(2e5,) * (len(rig.muscles) - 1))
    experiment = pamsim.pressure_step(pressures, pressures, duration=0.1)
    model = rig.model_for()
    data = mujoco.MjData(model)
    with live(model):
        if steps:
            settle_quickly(model, data, experiment, rig.limits, steps)
        else:
            settle(model, data, experiment)
    return data.qpos.copy(), data.qvel.copy(), data.time, model.opt.timestep


@pytest.mark.parametrize("name", ["mas20_arm", "two_joint_arm"])
def test_rest_in_longer_steps_is_the_same(name):
    rig = pamsim.load_rig(name)
    slow, quick = at_rest(rig, 0), at_rest(rig, 16)
    assert quick[0] == pytest.approx(slow[0], abs=np.deg2rad(0.02))
    assert not np.array_equal(quick[0], slow[0])  # it did settle in longer steps
    assert abs(quick[1]).max() < 1e-9
    assert quick[2:] == slow[2:]


def test_a_rig_that_breaks_down_in_longer_steps_settles_in_its_own():
    """In steps of 4 ms the bench's mass flies off."""
    rig = pamsim.load_rig("muscle_bench")
    for slow, quick in zip(at_rest(rig, 0), at_rest(rig, 8), strict=True):
        assert np.array_equal(slow, quick)
