"""Lengths and moment arms of tendons along a motion are those of the engine at each pose."""

import mujoco
import numpy as np
import pytest

import pamsim
from pamsim.engine.equilibrium import moment_arms, tendon_lengths
from pamsim.engine.stepping import muscle_ids


@pytest.mark.parametrize("name", ["two_joint_arm", "equimus_leg"])
def test_lengths_and_arms_of_many_poses_are_those_of_the_engine(name):
    rig = pamsim.load_rig(name)
    model, data = rig.model, mujoco.MjData(rig.model)
    poses = np.tile(model.qpos0, (3, 2, 1))
    joints = rig.position_addresses
    poses[..., joints] += 0.1 * np.random.default_rng(1).standard_normal((3, 2, len(joints)))
    lengths, arms = tendon_lengths(rig, poses), moment_arms(rig, poses)
    muscles = muscle_ids(model)
    assert (lengths.shape, arms.shape) == (
        (3, 2, len(muscles)),
        (3, 2, len(muscles), len(joints)),
    )
    degrees = [model.joint(joint).dofadr[0] for joint in rig.joints]
    for place in np.ndindex(3, 2):
        data.qpos[:] = poses[place]
        mujoco.mj_fwdPosition(model, data)
        full = np.zeros((model.nu, model.nv))
        mujoco.mju_sparse2dense(
            full, data.actuator_moment, data.moment_rownnz, data.moment_rowadr, data.moment_colind
        )
        np.testing.assert_allclose(lengths[place], data.actuator_length[muscles], rtol=1e-12)
        expected = full[np.ix_(muscles, degrees)]
        np.testing.assert_allclose(arms[place], expected, atol=1e-8)
        assert np.array_equal(moment_arms(rig, poses[place]), arms[place])
