"""Hidden effects at the joint: friction, drag, level, stop, ripple."""

from __future__ import annotations

import math
from functools import partial

from pamsim.effects.effect import JOINT, TILTED
from tests.plant.hidden.hidden_effect import Own, PlantEffect, Quantities, Quantity, on_joint
from tests.plant.hidden.virtual_tests import joint_friction
from tests.plant.read_rig import Numbers

_FRICTION, _DAMPING = f"joint.{JOINT}.frictionloss", f"joint.{JOINT}.damping"
_TILT = f"body.{TILTED}.tilt"

_SLIDING_SHARE = 0.55
"""Torque in fast sliding as a share of the breakaway torque, of friction with a Stribeck curve."""

_DRAG_POWER, _DRAG_SPEED = 1.25, 0.5
"""Exponent of the drag, and speed at which it equals viscous friction [rad/s]."""

_OTHER_AXIS = math.radians(25.0)
"""Angle between the axis about which the rig is tilted and the one that its model has."""

_TEETH = 16
_STOP = math.radians(8.0)
"""Angle at which the soft stop begins [rad]."""

_DETENT = {"detent_at": math.radians(-4.0), "detent_width": math.radians(2.0)}
"""Middle of the detent, and how far from it the torque is largest [rad]."""


def _sticking(n: Numbers, size: float) -> None:
    n.joint.dry += _SLIDING_SHARE * size
    n.joint.static, n.joint.static_speed = (1.0 - _SLIDING_SHARE) * size, 0.1


def _sliding(_: float, found: Quantities, own: Own) -> dict[str, float]:
    return {_FRICTION: own(_FRICTION) + found["sliding_torque"].value}


def _at_half(n: Numbers, _: Numbers, __: float) -> Quantities:
    drag = float(n.joint[0].drag) * _DRAG_SPEED ** float(n.joint[0].drag_power)
    return {
        "torque_at_speed": Quantity(drag, "N*m"),
        "at_speed": Quantity(_DRAG_SPEED, "rad/s"),
    }


def _tilted(n: Numbers, size: float) -> None:
    turned = 9.81 * n.joint.moment * math.sin(size)
    n.joint.weight_cos -= turned * math.cos(_OTHER_AXIS)
    n.joint.weight_sin += turned * math.sin(_OTHER_AXIS)


def _weight(there: Numbers, without: Numbers, _: float) -> Quantities:
    change = float(there.joint[0].weight_cos - without.joint[0].weight_cos)
    return {"torque_at_zero": Quantity(change, "N*m")}


def _cables(n: Numbers, size: float) -> None:
    n.joint.stiffness += size


_friction = partial(
    PlantEffect,
    stands_for=("stribeck_friction", "coulomb_friction"),
    unit="N*m",
    typical=0.3,
    measure=joint_friction,
    library=_sliding,
)

EFFECTS = (
    _friction(
        name="dahl_friction",
        formulation="Dahl friction at the joint with exponent 1.5: it gives about 1.5 mrad before"
        " it slides",
        stands_for=("coulomb_friction",),
        change=on_joint("bristle", bristle_slip=1.5e-3, bristle_power=1.5),
    ),
    _friction(
        name="tanh_friction",
        formulation="joint friction that is smooth in speed (tanh): it does not stick",
        stands_for=("coulomb_friction",),
        change=on_joint("smooth_dry", smooth_speed=0.02),
    ),
    _friction(
        name="sticking_friction",
        formulation="joint friction with a Stribeck curve that truly sticks, located by events",
        change=_sticking,
    ),
    _friction(
        name="lugre_friction",
        formulation="LuGre friction at the joint with a Stribeck curve",
        change=on_joint(
            lambda s: {
                "bristle": _SLIDING_SHARE * s,
                "bristle_static": (1.0 - _SLIDING_SHARE) * s,
                "bristle_damping": 0.3 * s,
            },
            **{"bristle_slip": 1e-3, "bristle_speed": 0.12, "bristle_power": 1.0},
        ),
    ),
    PlantEffect(
        name="loaded_friction",
        formulation="bearing friction that sticks, proportional to the sum of the tensions",
        stands_for=("load_dependent_friction",),
        resembles=("coulomb_friction", "stribeck_friction", "muscle_hysteresis"),
        unit="m",
        typical=2e-4,
        change=on_joint("carried"),
        measure=joint_friction,
    ),
    PlantEffect(
        name="power_drag",
        formulation="joint friction proportional to speed to the power of 1.25",
        stands_for=("viscous_friction",),
        unit="N*m*s/rad",
        typical=0.12,
        change=on_joint(
            lambda s: {"drag": s * _DRAG_SPEED ** (1.0 - _DRAG_POWER), "drag_power": _DRAG_POWER}
        ),
        measure=_at_half,
        library=lambda size, _, own: {_DAMPING: own(_DAMPING) + size},
        signed=True,
    ),
    PlantEffect(
        name="tilted_ground",
        formulation="ground tilted about another axis than the rig's, 25 deg from it",
        stands_for=("load_torque",),
        unit="rad",
        typical=0.03,
        change=_tilted,
        measure=_weight,
        library=lambda size, _, own: {_TILT: own(_TILT) + size * math.cos(_OTHER_AXIS)},
        signed=True,
    ),
    PlantEffect(
        name="cogging_torque",
        formulation="a torque of 16 periods per turn",
        stands_for=("sprocket_ripple",),
        unit="N*m",
        typical=0.15,
        change=on_joint("ripple", ripple_periods=_TEETH, ripple_phase=0.7),
        stated="torque_amplitude",
        signed=True,
    ),
    PlantEffect(
        name="soft_stop",
        formulation="a soft stop on one side, from 8 deg on",
        unit="N*m/rad",
        typical=4.0,
        change=on_joint("stop_stiffness", stop_at=_STOP),
        stated="stiffness",
    ),
    PlantEffect(
        name="detent",
        formulation="a detent that draws the joint to -4 deg from a few degrees around",
        unit="N*m",
        typical=0.3,
        change=on_joint("detent", **_DETENT),
        stated="largest_torque",
    ),
    PlantEffect(
        name="cable_spring",
        formulation="hoses and cables that bend with the joint",
        resembles=("passive_stiffness", "angle_scale", "load_torque"),
        unit="N*m/rad",
        typical=0.2,
        change=_cables,
        stated="stiffness",
        signed=True,
    ),
)
"""Hidden effects at the joint."""
