"""The numbers of a plant from a rig's parameters and its rigid bodies."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.parameters import ParameterGroup
from pamsim.core.units import FloatArray
from pamsim.engine.mjcf_fields import native_value
from pamsim.engine.rig import Rig
from tests.plant.records import JOINT, MUSCLE, Record

_HINGE, _ON_JOINT = 3, 1
"""Codes of a hinge and of a tendon that is proportional to a joint's angle in a compiled model."""


@dataclass(frozen=True, kw_only=True)
class Numbers:
    """What describes a plant.

    Attributes:
        joint: (1,) record of `JOINT`.
        muscles: (m,) records of `MUSCLE`.
    """

    joint: Record
    muscles: Record

    def copy(self) -> Numbers:
        """A copy that may be changed."""
        return Numbers(joint=self.joint.copy(), muscles=self.muscles.copy())


def read_rig(rig: Rig, load: float) -> Numbers:
    """Numbers of a rig under a load.

    Args:
        rig: with one hinge that all its moving bodies turn about, and muscles on fixed tendons.
        load: [kg].

    Raises:
        InputError: if the rig has another joint, tendon or law than the plant.
    """
    model = rig.model_for(load=load)
    if model.njnt != 1 or int(model.jnt_type[0]) != _HINGE:
        raise InputError(
            f"{rig.name}: the independent plant has one hinge; this rig has {model.njnt} joints"
        )
    joint = np.zeros(1, dtype=JOINT).view(np.recarray)
    inertia, weight_cos, weight_sin, joint.moment = _rigid_body(model)
    joint.inertia = inertia + float(model.dof_armature[0])
    joint.weight_cos, joint.weight_sin = weight_cos, weight_sin
    joint.damping = float(model.dof_damping[0])
    joint.dry = float(model.dof_frictionloss[0])
    if joint.dry > 0.0 and native_value(model, f"joint.{rig.only_joint}.friction_speed") > 0.0:
        raise InputError(
            f"{rig.name}: the joint's friction does not stick (friction_speed); the independent"
            " plant has tanh_friction for that"
        )
    joint.stiffness = float(model.jnt_stiffness[0])
    joint.spring_at = float(model.qpos_spring[0])
    muscles = np.zeros(len(rig.muscles), dtype=MUSCLE).view(np.recarray)
    for row, (name, muscle) in zip(muscles, rig.muscles.items(), strict=True):
        tendon = model.tendon(rig.file.tendons[name]).id
        first = int(model.tendon_adr[tendon])
        if model.tendon_num[tendon] != 1 or int(model.wrap_type[first]) != _ON_JOINT:
            raise InputError(
                f"{rig.name}: the independent plant needs {name} on a fixed tendon of the joint"
            )
        row.arm = float(model.wrap_prm[first])
        _write_muscle(row, muscle, f"{rig.name}, {name}")
    for name, (group, fields) in _SHARED.items():
        stated = {
            tuple(getattr(getattr(m, group), field) for field in fields.values())
            for m in rig.muscles.values()
        }
        if len(stated) != 1:
            raise InputError(f"{rig.name}: the independent plant has one {name} for all muscles")
        for field, value in zip(fields, *stated, strict=True):
            joint[field] = value
    lines = {(m.valve.supply_line, m.valve.supply_pressure) for m in rig.muscles.values()}
    if float(joint.refill[0] + joint.refill_square[0]) > 0.0 and len(lines) != 1:
        raise InputError(f"{rig.name}: the independent plant has one supply for all muscles")
    return Numbers(joint=joint, muscles=muscles)


def _write_muscle(row: Record, muscle: object, where: str) -> None:
    """Copy a muscle's parameters into its record."""
    groups = {f.name: getattr(muscle, f.name) for f in dataclasses.fields(muscle)}  # pyright: ignore[reportArgumentType]
    force, loop = groups["force"], groups["hysteresis"]
    if force.law not in _FORCES:
        raise InputError(f"{where}: the independent plant has no force law {force.law!r}")
    row.law = float(_FORCES.index(force.law))
    for name in ("scale", "a", "b", "c", "d", "e", "f"):
        setattr(row, name, getattr(force, name, 0.0))
    row.loop_yield, row.loop_sigma, row.loop_sharpness = 1.0, 0.5, 1.0
    if loop is not None:
        if loop.law != "bouc_wen":
            raise InputError(f"{where}: the independent plant has no hysteresis {loop.law!r}")
        row.loop_force, row.loop_per_pressure = loop.force, loop.force_per_pressure
        row.loop_share = loop.force_share
        row.loop_yield, row.loop_sigma = loop.yield_contraction, loop.sigma
        row.loop_sharpness = loop.sharpness
    for field, (group, name) in _COPIED.items():
        setattr(row, field, getattr(groups[group], name))
    zone, uneven = groups["valve"].dead_zone, groups["valve"].dead_zone_asymmetry
    row.dead_zone_fill = min(zone * (1.0 + uneven), 0.9)
    row.dead_zone_exhaust = min(zone * (1.0 - uneven), 0.9)
    _refuse_unknown(groups, where)


def _refuse_unknown(groups: Mapping[str, Any], where: str) -> None:
    """Refuse a parameter that acts in the engine and that the plant does not have."""
    known = set(_COPIED.values()) | _DEAD_ZONES | _WITHOUT_INFLUENCE
    known |= {(group, field) for group, fields in _SHARED.values() for field in fields.values()}
    for group, values in groups.items():
        if not isinstance(values, ParameterGroup) or group in ("force", "hysteresis"):
            continue
        for field in dataclasses.fields(values):
            if (group, field.name) not in known and getattr(values, field.name) != field.default:
                raise InputError(f"{where}: the independent plant has no {group}.{field.name}")


_SHARED = {
    "backlash": ("chain", {"backlash": "backlash", "shift_damping": "seating_damping"}),
    "supply": (
        "valve",
        {
            "refill": "supply_resistance",
            "refill_square": "supply_square",
            "reservoir": "supply_volume",
        },
    ),
}
"""What all muscles share -> group, and field of the joint's record -> parameter of the group."""

_WITHOUT_INFLUENCE = {("chamber", "floor"), ("valve", "pulse_period"), ("valve", "supply_line")}

_DEAD_ZONES = {("valve", "dead_zone"), ("valve", "dead_zone_asymmetry")}
"""What the plant states as a number for each valve."""

_FORCES = ("six_parameter", "ideal_mckibben")

_COPIED = {
    "length_at_zero": ("mounting", "length_at_zero"),
    "nominal_length": ("braid", "nominal_length"),
    "diameter": ("braid", "diameter"),
    "fibre_angle": ("braid", "fibre_angle"),
    "extensibility": ("braid", "extensibility"),
    "passive_stiffness": ("passive", "stiffness"),
    "passive_softening": ("passive", "softening"),
    "passive_slack": ("passive", "slack_contraction"),
    "passive_locking": ("passive", "locking"),
    "threshold": ("threshold", "pressure"),
    "end_loss": ("end_shape", "loss"),
    "end_onset": ("end_shape", "onset"),
    "creep_0": ("creep", "stiffness"),
    "creep_time_0": ("creep", "relaxation_time"),
    "ageing": ("softening", "share"),
    "ageing_time": ("softening", "time"),
    "polytropic": ("chamber", "polytropic_index"),
    "temperature": ("chamber", "temperature"),
    "dead_volume": ("chamber", "dead_volume"),
    "atmosphere": ("chamber", "atmosphere"),
    "leak": ("chamber", "leak_conductance"),
    "fill_conductance": ("valve", "conductance_fill"),
    "exhaust_conductance": ("valve", "conductance_exhaust"),
    "critical": ("valve", "critical_ratio"),
    "laminar": ("valve", "laminar_ratio"),
    "supply": ("valve", "supply_pressure"),
    "band": ("valve", "regulator_band"),
    "dead_band": ("valve", "regulator_dead_band"),
    "lag": ("valve", "line_lag"),
    "delay": ("valve", "delay"),
    "compliance": ("chain", "compliance"),
    "compliance_time": ("chain", "relaxation_time"),
    "teeth": ("chain", "ripple"),
    "teeth_pitch": ("chain", "ripple_pitch"),
    "teeth_phase": ("chain", "ripple_phase"),
    "braid_rub": ("braid", "friction"),
    "brake": ("friction", "stribeck_force"),
    "brake_speed": ("friction", "stribeck_velocity"),
    "rub": ("friction", "coulomb_force"),
    "rub_static": ("friction", "breakaway_force"),
    "rub_share": ("friction", "tension_share"),
    "rub_travel": ("friction", "presliding"),
    "rub_time": ("friction", "bristle_time"),
}
"""Field of the record -> group and name of the rig's parameter."""


def _rotation(quat: FloatArray) -> FloatArray:
    """Rotation matrix of a unit quaternion w, x, y, z."""
    w, v = quat[0], quat[1:]
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + 2.0 * w * cross + 2.0 * cross @ cross


def _rigid_body(model: object) -> tuple[float, float, float, float]:
    """Moment of inertia about the hinge, the two parts of gravity's torque, and mass moment."""
    m: Record = model
    place = {0: (np.zeros(3), np.eye(3))}
    moving: dict[int, bool] = {0: False}
    carrier = int(m.jnt_bodyid[0])
    for body in range(1, int(m.nbody)):
        parent = int(m.body_parentid[body])
        origin, turned = place[parent]
        place[body] = (
            origin + turned @ m.body_pos[body],
            turned @ _rotation(m.body_quat[body]),
        )
        moving[body] = moving[parent] or body == carrier
    origin, turned = place[carrier]
    axis = turned @ m.jnt_axis[0]
    axis = axis / math.sqrt(float(axis @ axis))
    hinge = origin + turned @ m.jnt_pos[0]
    inertia, moment = 0.0, np.zeros(3)
    for body, turns in moving.items():
        if not turns:
            continue
        origin, turned = place[body]
        mass = float(m.body_mass[body])
        arm = origin + turned @ m.body_ipos[body] - hinge
        across = arm - axis * float(axis @ arm)
        own = (turned @ _rotation(m.body_iquat[body])).T @ axis
        inertia += mass * float(across @ across) + float(own**2 @ m.body_inertia[body])
        moment += mass * across
    gravity = np.asarray(m.opt.gravity)
    along = float(axis @ np.cross(moment, gravity))
    beside = float(axis @ np.cross(np.cross(axis, moment), gravity))
    return inertia, along, beside, math.sqrt(float(moment @ moment))
