"""Put a model into a position for a picture, read where its parts are, and see all of them.

No time passes.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence

import mujoco
import numpy as np

from pamsim.core.errors import EngineError
from pamsim.core.units import FloatArray
from pamsim.engine.stepping import muscle_ids
from pamsim.physics.record import view
from pamsim.physics.static_muscle import muscle_length

_FILLED = 0.94  # share of the window beside the plots that the arm fills, in width or in height
_ROUNDS = 30
_CORNERS = np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).reshape(3, 8).T


def pose(
    model: mujoco.MjModel, data: mujoco.MjData, addresses: Sequence[int], positions: Sequence[float]
) -> None:
    """Move joints to positions [rad or m] and update everything in ``data`` that a picture shows.

    The addresses are those in ``data.qpos``, such as `Rig.position_addresses`. The model needs no
    callback, because no force is computed.
    """
    data.qpos[addresses] = positions
    mujoco.mj_fwdPosition(model, data)


def muscle_lengths(model: mujoco.MjModel, data: mujoco.MjData) -> list[float]:
    """Lengths (m,) [m] of all muscles, in actuator order, at the last computed tendon lengths."""
    lengths = data.actuator_length[model.actuator_outadr].tolist()
    return [muscle_length(view(model.actuator_user[i]), lengths[i]) for i in muscle_ids(model)]


def has_site(model: mujoco.MjModel, name: str) -> bool:
    """Whether a model has a site of a name."""
    return mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, name) >= 0


def site_pose(
    model: mujoco.MjModel, data: mujoco.MjData, name: str
) -> tuple[FloatArray, FloatArray]:
    """Position (3,) [m] and frame (3, 3) of a site in the world.

    Raises:
        EngineError: if the model does not have it.
    """
    index = object_id(model, mujoco.mjtObj.mjOBJ_SITE, name)
    return data.site_xpos[index].copy(), data.site_xmat[index].reshape(3, 3).copy()


def object_id(model: mujoco.MjModel, kind: mujoco.mjtObj, name: str) -> int:
    """Id of a named object that a picture needs.

    Raises:
        EngineError: if the model does not have it.
    """
    index = mujoco.mj_name2id(model, kind, name)
    if index < 0:
        what = kind.name.removeprefix("mjOBJ_").lower()
        raise EngineError(
            f"the picture needs a {what} named {name!r}, which this model does not have"
        )
    return index


def seen_by(scene: mujoco.MjvScene, points: FloatArray) -> FloatArray:
    """Tangents (n, 2), to the right and up, at which a scene's camera sees points (n, 3) [m]."""
    left, right = scene.camera[0], scene.camera[1]
    away = points - (np.array(left.pos) + np.array(right.pos)) / 2.0
    return away @ _across(scene).T / (away @ np.array(left.forward))[:, None]


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
    scene, points = mujoco.MjvScene(model, maxgeom=1), _reach(model, data)
    if points.size == 0:  # bodies without a shape
        return
    camera.lookat = points.mean(axis=0)
    camera.distance = 3.0 * float(np.ptp(points, axis=0).max())
    low, high = np.array([2.0 * column - 1.0, -1.0]), np.ones(2)
    half = math.tan(math.radians(model.vis.global_.fovy) / 2.0) * np.array([aspect, 1.0])
    for _ in range(_ROUNDS):
        mujoco.mjv_updateCamera(model, data, camera, scene)
        placed = seen_by(scene, points) / half
        least, most = placed.min(axis=0), placed.max(axis=0)
        move = ((least + most) - (low + high)) / 2.0 * half * camera.distance
        camera.lookat = camera.lookat + move @ _across(scene)
        camera.distance *= float(((most - least) / (high - low)).max()) / _FILLED


def _across(scene: mujoco.MjvScene) -> FloatArray:
    """(2, 3) unit vectors to the right and up of a scene's camera."""
    ahead, up = np.array(scene.camera[0].forward), np.array(scene.camera[0].up)
    return np.array([np.cross(ahead, up), up])


def _reach(model: mujoco.MjModel, data: mujoco.MjData) -> FloatArray:
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
