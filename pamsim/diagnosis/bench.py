"""A rig taken apart for virtual tests of its parts, and the conditions of these tests.

The ground truth of the tests' independent plant is measured under the same.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import mujoco
import numpy as np

from pamsim.core.units import FloatArray
from pamsim.engine.rig import Rig
from pamsim.physics.record import Parameters, slot, state_size, view
from pamsim.recordings.sensors import MeasurementChain

PRESSURE = 2.5e5
"""Gauge pressure [Pa]."""

STRAIN = 0.015
"""Amplitude of a muscle's cycle about its nominal length [-]."""

TURN = 0.1
"""Amplitude of the cycles of a joint that turns [rad]."""

SLOW, FAST = 0.01, 0.5
"""Speeds of these cycles [rad/s]."""

ANGLE = 0.5
"""At which the scale of an angle sensor is stated [rad]: near the end of a MAS-20 arm's range."""

_ARM = 0.025
"""A joint that slides is tested over this travel per radian [m], the moment arm of a MAS-20 arm:
its muscle then moves as far and as fast as that of a joint that turns."""

CONTRACTION_RATE = 0.1
"""Of the braid's test [1/s]."""

CONDITIONS = {
    "at_pressure": (PRESSURE, "Pa"),
    "at_speed": (FAST, "rad/s"),
    "at_sliding_speed": (_ARM * FAST, "m/s"),
    "at_contraction_rate": (CONTRACTION_RATE, "1/s"),
    "at_angle": (ANGLE, "rad"),
    "at_position": (_ARM * ANGLE, "m"),
    "angle_amplitude": (TURN, "rad"),
    "stroke_amplitude": (_ARM * TURN, "m"),
    "contraction_amplitude": (STRAIN, "1"),
}
"""Quantity that states a condition -> value [unit] and SI unit."""


@dataclass(frozen=True, kw_only=True)
class Motion:
    """How a joint of one kind is tested, and in which units."""

    unit: str  # SI unit of its position
    effort: str  # what moves it, ``torque`` or ``force``
    effort_unit: str  # SI unit of that
    inertia_unit: str  # SI unit of its inertia
    scale: float  # of the tests of a joint that turns, to positions in ``unit``
    at_speed: str  # condition that states the fast speed
    at_place: str  # condition that states the position of a sensor's test
    amplitude: str  # condition that states the amplitude of its cycles


MOTIONS: Mapping[str, Motion] = {
    "angle": Motion(
        unit="rad",
        effort="torque",
        effort_unit="N*m",
        inertia_unit="kg*m^2",
        scale=1.0,
        at_speed="at_speed",
        at_place="at_angle",
        amplitude="angle_amplitude",
    ),
    "position": Motion(
        unit="m",
        effort="force",
        effort_unit="N",
        inertia_unit="kg",
        scale=_ARM,
        at_speed="at_sliding_speed",
        at_place="at_position",
        amplitude="stroke_amplitude",
    ),
}
"""Kind of a joint, see `pamsim.engine.rig.Rig`, to its tests."""


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
