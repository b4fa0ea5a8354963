"""The joints of a rig whose positions are recorded."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError

_KINDS = {int(mujoco.mjtJoint.mjJNT_HINGE): "angle", int(mujoco.mjtJoint.mjJNT_SLIDE): "position"}
_PLACES = (0.5, 0.31, 0.73)
"""Shares of the joints' ranges at which tendons are measured: one place alone may be a dead centre
of a spatial tendon."""

_UNLIMITED = (-0.5, 0.5)
_MOVE = 1e-4  # rad or m
_LEAST_ARM = 1e-6  # change of a tendon's length per change of the joint [m/rad or 1]


def recorded_joints(
    model: mujoco.MjModel, named: Iterable[str], tendons: Iterable[str], where: Path
) -> dict[str, str]:
    """Name and kind of the joints that a rig records.

    Args:
        model: compiled.
        named: joints that the rig's file names; all that the muscles move if there are none.
        tendons: of the muscles.
        where: the rig's file, for errors.

    Returns:
        Joint -> ``angle`` or ``position``.

    Raises:
        InputError: if a joint is free or a ball, has no name, or there is none.
    """
    found: dict[str, str] = {}
    for index in [model.joint(name).id for name in named] or _moved(model, tendons):
        name, kind = model.joint(index).name, _KINDS.get(int(model.jnt_type[index]))
        if not name:
            raise InputError(
                f"{where}: the muscles move a joint without a name; name it in the MJCF"
            )
        if kind is None:
            raise InputError(
                f"{where}: joint {name!r} neither turns about one axis nor slides along one; name"
                " the joints to record as [rig] joints"
            )
        found[name] = kind
    if not found:
        raise InputError(f"{where}: no joint is moved by the muscles; check their tendons")
    return found


def _moved(model: mujoco.MjModel, tendons: Iterable[str]) -> list[int]:
    """Numbers of the joints that change the length of a muscle's tendon."""
    wanted = [model.tendon(name).id for name in tendons]
    scalar = [joint for joint in range(model.njnt) if int(model.jnt_type[joint]) in _KINDS]
    data = mujoco.MjData(model)
    start = data.qpos.copy()
    moved: list[int] = []
    for joint in scalar:
        for place in _PLACES:
            data.qpos[:] = start
            for other in scalar:
                low, high = model.jnt_range[other] if model.jnt_limited[other] else _UNLIMITED
                data.qpos[model.jnt_qposadr[other]] = low + place * (high - low)
            before = _lengths(model, data)[wanted].copy()
            data.qpos[model.jnt_qposadr[joint]] += _MOVE
            if np.any(np.abs(_lengths(model, data)[wanted] - before) > _LEAST_ARM * _MOVE):
                moved.append(joint)
                break
    return moved


def _lengths(model: mujoco.MjModel, data: mujoco.MjData) -> NDArray[np.float64]:
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_tendon(model, data)
    return data.ten_length
