"""Look things of a model up by name, for pictures."""

from __future__ import annotations

import mujoco

from pamsim.core.errors import EngineError, InputError, nearest
from pamsim.scene.muscle_shape import Vector


def site_pose(model: mujoco.MjModel, data: mujoco.MjData, name: str) -> tuple[Vector, Vector]:
    """Return position (3,) [m] and frame (3, 3) of a site in the world.

    Raises:
        EngineError: if the model lacks it.
    """
    index = object_id(model, mujoco.mjtObj.mjOBJ_SITE, name)
    return data.site_xpos[index].copy(), data.site_xmat[index].reshape(3, 3).copy()


def object_id(model: mujoco.MjModel, kind: mujoco.mjtObj, name: str) -> int:
    """Id of a named object.

    Raises:
        EngineError: saying which object the picture needs, if the model lacks it.
    """
    index = mujoco.mj_name2id(model, kind, name)
    if index < 0:
        what = kind.name.removeprefix("mjOBJ_").lower()
        raise EngineError(f"the picture needs a {what} named {name!r}, which this model lacks")
    return index


def require_camera(model: mujoco.MjModel, camera: str) -> None:
    """See that a scene has a camera that a user asked for.

    Raises:
        InputError: naming the cameras there are, if it has not.
    """
    cameras = [model.camera(i).name for i in range(model.ncam)]
    if camera not in cameras:
        raise InputError(f"no camera {camera!r} in this scene; {nearest(camera, cameras)}")
