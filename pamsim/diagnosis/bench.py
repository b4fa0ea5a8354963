"""A rig taken apart, for tests of its parts."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from pamsim.core.units import FloatArray
from pamsim.diagnosis.virtual_test_conditions import MOTIONS, Motion
from pamsim.engine.rig import Rig
from pamsim.physics.record import Parameters, slot, state_size, view
from pamsim.recordings.sensors import MeasurementChain


@dataclass(frozen=True, kw_only=True)
class Bench:
    """A rig taken apart.

    A joint that slides has metres for radians and newtons for newton metres.
    """

    motion: Motion  # units and tests of the joint
    muscles: tuple[Parameters, ...]  # parameters of each
    states: tuple[int, ...]  # number of states of each muscle
    lengths: tuple[float, ...]  # of each tendon at position 0 [m]
    arms: tuple[float, ...]  # change of each tendon's length with the position, there [m/rad]
    dry: float  # dry friction of the joint and, over their arms, of the tendons [N m]
    dry_speed: float  # joint speed below which it is proportional to speed [rad/s]; 0 if it sticks
    damping: float  # viscous friction of both [N m s/rad]
    quadratic_damping: float  # of the joint [N m s^2/rad^2]
    inertia: float  # about the joint, without load [kg m^2]
    weight: float  # torque of gravity at position 0, without load [N m]
    sensor: MeasurementChain  # the measurement chain


def bench(rig: Rig, name: str = "") -> Bench:
    """Take a rig apart, to test a joint, the others at 0; the only one if none is named.

    Raises:
        InputError: if none is named and there are several.
    """
    name = name or rig.only_joint
    model = rig.model_for()
    model.actuator_user[:, slot("command")] = 0.0  # the control is a signed opening
    data = mujoco.MjData(model)
    tendons = [model.tendon(name).id for name in rig.file.tendons.values()]
    places: list[FloatArray] = []
    for angle in (-1e-6, 1e-6, 0.0):
        data.qpos[model.joint(name).qposadr[0]] = angle
        mujoco.mj_fwdPosition(model, data)
        places.append(data.ten_length[tendons].copy())
    arms = (places[1] - places[0]) / 2e-6
    mujoco.mj_fwdVelocity(model, data)
    joint = int(model.joint(name).dofadr[0])
    turned, inertia = np.zeros(model.nv), np.zeros(model.nv)
    turned[joint] = 1.0
    mujoco.mj_mulM(model, data, inertia, turned)
    return Bench(
        motion=MOTIONS[rig.joints[name]],
        muscles=tuple(view(model.actuator_user[i]) for i in range(len(rig.muscles))),
        states=tuple(state_size(muscle) for muscle in rig.muscles.values()),
        lengths=tuple(places[2].tolist()),
        arms=tuple(arms.tolist()),
        dry=float(
            model.dof_frictionloss[joint] + np.abs(arms) @ model.tendon_frictionloss[tendons]
        ),
        dry_speed=float(model.jnt_user[model.dof_jntid[joint], -1]),
        damping=float(model.dof_damping[joint] + arms**2 @ np.ravel(model.tendon_damping[tendons])),
        quadratic_damping=float(model.dof_dampingpoly[joint, 0]),
        inertia=float(inertia[joint]),
        weight=-float(data.qfrc_bias[joint]),
        sensor=rig.sensor or MeasurementChain(),
    )
