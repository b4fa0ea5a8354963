"""Put a model into a position for a picture and read where its parts are; no time passes."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco

from pamsim.core.errors import EngineError
from pamsim.engine.stepping import muscle_ids
from pamsim.physics.record import view
from pamsim.physics.static_muscle import muscle_length
from pamsim.scene.solids import Vector


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


def site_pose(model: mujoco.MjModel, data: mujoco.MjData, name: str) -> tuple[Vector, Vector]:
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
