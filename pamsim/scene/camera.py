"""Where a camera shows points, and a free camera that shows the whole arm."""

from __future__ import annotations

import copy
import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.scene.solids import Vector

_FILLED = 0.94  # share of the window beside the plots that the arm fills, in width or in height
_ROUNDS = 30
_CORNERS = np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).reshape(3, 8).T


def seen_from(
    points: Vector, eye: Vector, ahead: NDArray[np.floating], up: NDArray[np.floating]
) -> Vector:
    """Tangents (n, 2), to the right and up, of points (n, 3) [m] seen from an eye (3,) [m].

    Ahead (3,) and up (3,) are unit vectors at right angles.
    """
    away = points - eye
    return away @ np.column_stack([np.cross(ahead, up), up]) / (away @ ahead)[:, None]


def window_places(camera: mujoco.MjvCamera, points: Vector, half: Vector) -> Vector:
    """Where a free camera shows points (n, 3) [m]: (n, 2), -1 to 1 rightwards and upwards.

    ``half`` (2,) are the tangents of half the width and half the height seen.
    """
    ahead, _, up = _axes(camera)
    return seen_from(points, camera.lookat - camera.distance * ahead, ahead, up) / half


def fit_camera(
    camera: mujoco.MjvCamera,
    model: mujoco.MjModel,
    data: mujoco.MjData,
    *,
    aspect: float,
    column: float,
) -> None:
    """Turn a free camera so that the arm fills the window beside the plots wherever it moves.

    It looks in the direction of the scene's camera ``overview``, if there is one. The window has an
    aspect, width over height, and a column at its left, a share of its width, that is left free.
    """
    mujoco.mjv_defaultFreeCamera(model, camera)
    fixed = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_CAMERA, "overview")
    if fixed >= 0:
        mujoco.mj_forward(model, data)
        ahead = -data.cam_xmat[fixed].reshape(3, 3)[:, 2]
        camera.azimuth = math.degrees(math.atan2(ahead[1], ahead[0]))
        camera.elevation = math.degrees(math.asin(ahead[2]))
    points = _reach(model, data)
    camera.lookat = points.mean(axis=0)
    camera.distance = 3.0 * float(np.ptp(points, axis=0).max())
    low, high = np.array([2.0 * column - 1.0, -1.0]), np.ones(2)
    half = math.tan(math.radians(model.vis.global_.fovy) / 2.0) * np.array([aspect, 1.0])
    for _ in range(_ROUNDS):
        placed = window_places(camera, points, half)
        least, most = placed.min(axis=0), placed.max(axis=0)
        move = ((least + most) - (low + high)) / 2.0 * half * camera.distance
        camera.lookat = camera.lookat + move @ _axes(camera)[1:]
        camera.distance *= float(((most - least) / (high - low)).max()) / _FILLED


def _axes(camera: mujoco.MjvCamera) -> Vector:
    """Ahead, right and up of a free camera, (3, 3)."""
    turn, lift = math.radians(camera.azimuth), math.radians(camera.elevation)
    flat = np.array([math.cos(turn), math.sin(turn), 0.0])
    up = np.array([0.0, 0.0, 1.0])
    ahead = math.cos(lift) * flat + math.sin(lift) * up
    return np.array([ahead, np.cross(flat, up), math.cos(lift) * up - math.sin(lift) * flat])


def _reach(model: mujoco.MjModel, data: mujoco.MjData) -> Vector:
    """Corners of every geom but floors, at rest and with each joint at its limits, (n, 3) [m]."""
    data = copy.copy(data)
    poses = [data.qpos.copy()]
    for joint in np.flatnonzero(model.jnt_limited):
        for limit in model.jnt_range[joint]:
            poses.append(poses[0].copy())
            poses[-1][model.jnt_qposadr[joint]] = limit
    solid = model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE
    corners = model.geom_aabb[solid, None, :3] + _CORNERS * model.geom_aabb[solid, None, 3:]
    found = []
    for positions in poses:
        data.qpos[:] = positions
        mujoco.mj_kinematics(model, data)
        turned = data.geom_xmat[solid].reshape(-1, 3, 3)
        found.append(corners @ turned.transpose(0, 2, 1) + data.geom_xpos[solid, None])
    return np.concatenate(found).reshape(-1, 3)
