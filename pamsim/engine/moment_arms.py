"""Moment arms of a rig's muscles: by how much each lengthens as a joint turns or slides."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.engine.rig import Rig
from pamsim.engine.stepping import muscle_ids

FloatArray = NDArray[np.float64]

_TURN = 1e-5  # rad or m


def moment_arms(rig: Rig, position: FloatArray) -> FloatArray:
    """Change of each tendon's length with each recorded joint's position.

    Args:
        rig: the rig.
        position: (nq,) at which they are taken [rad or m].

    Returns:
        (m, j) [m/rad or 1].
    """
    columns = []
    for address in rig.position_addresses:
        turn = np.zeros(len(position))
        turn[address] = _TURN
        ahead, behind = (tendon_lengths(rig, position + side * turn) for side in (1.0, -1.0))
        columns.append((ahead - behind) / (2.0 * _TURN))
    return np.column_stack(columns)


def tendon_lengths(rig: Rig, position: FloatArray) -> FloatArray:
    """(m,) lengths of the muscles' tendons [m] at a position (nq,) [rad or m]."""
    model, data = rig.model, mujoco.MjData(rig.model)
    data.qpos[:] = position
    mujoco.mj_fwdPosition(model, data)
    return data.actuator_length[[model.actuator_outadr[i] for i in muscle_ids(model)]].copy()
