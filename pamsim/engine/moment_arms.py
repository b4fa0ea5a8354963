"""Moment arms of a rig's muscles: by how much each tendon shortens as a joint turns or slides."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.engine.callback import muscle_ids
from pamsim.engine.rig import Rig

_MOVE = 1e-5  # rad or m


def moment_arms(rig: Rig) -> NDArray[np.float64]:
    """Moment arms at the MJCF's start pose.

    Args:
        rig: loaded.

    Returns:
        (joints, muscles) [m/rad, or 1 of a joint that slides], positive where a muscle that
        shortens makes the position grow.
    """
    model = rig.model
    data = mujoco.MjData(model)
    start = data.qpos.copy()
    tendons = [int(model.actuator_trnid[index, 0]) for index in muscle_ids(model)]

    def lengths(address: int, move: float) -> NDArray[np.float64]:
        data.qpos[:] = start
        data.qpos[address] += move
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_tendon(model, data)
        return data.ten_length[tendons].copy()

    return np.array(
        [
            (lengths(address, -_MOVE) - lengths(address, _MOVE)) / (2.0 * _MOVE)
            for address in rig.position_addresses
        ]
    )
