"""Put a model into a position to be looked at, and read its muscles' lengths: no time passes."""

from __future__ import annotations

import mujoco

from pamsim.actuator.kernel import muscle_length
from pamsim.engine.callback import muscle_ids


def pose(model: mujoco.MjModel, data: mujoco.MjData, address: int, angle: float) -> None:
    """Turn one joint and bring all that a picture shows up to date.

    Args:
        model: any model; it needs no callback, since nothing here asks for a force.
        data: its data, changed in place.
        address: index of the joint's angle in ``data.qpos``, such as `Rig.angle_address`.
        angle: [rad].
    """
    data.qpos[address] = angle
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_camlight(model, data)
    mujoco.mj_tendon(model, data)
    mujoco.mj_transmission(model, data)


def muscle_lengths(model: mujoco.MjModel, data: mujoco.MjData) -> list[float]:
    """Lengths of all muscles at the last computed tendon lengths, chain taken up.

    Returns:
        (m,) [m], in actuator order.
    """
    return [
        muscle_length(
            model.actuator_user[index].tolist(),
            float(data.actuator_length[model.actuator_outadr[index]]),
        )
        for index in muscle_ids(model)
    ]
