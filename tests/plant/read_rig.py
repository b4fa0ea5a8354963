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
        return Numbers(joint=self.joint.copy(), muscles=self.muscles.copy())


def _refused(where: str, why: str) -> InputError:
    return InputError(f"{where}: the independent plant {why}")


def read_rig(rig: Rig, load: float) -> Numbers:
    """Numbers of a rig under a load.

    The rig has one hinge that all its moving bodies turn about, and muscles on fixed tendons.
    """
    model = rig.model_for(load=load)
    if model.njnt != 1 or int(model.jnt_type[0]) != _HINGE:
        raise _refused(rig.name, f"has one hinge; this rig has {model.njnt} joints")
    joint = np.zeros(1, dtype=JOINT).view(np.recarray)
    inertia, joint.weight_cos, joint.weight_sin, joint.moment = _rigid_body(model)
    joint.inertia = inertia + float(model.dof_armature[0])
    joint.damping = float(model.dof_damping[0])
    joint.drag, joint.drag_power = float(model.dof_dampingpoly[0, 0]), 2.0
    joint.dry = float(model.dof_frictionloss[0])
    if joint.dry > 0.0 and native_value(model, f"joint.{rig.only_joint}.friction_speed") > 0.0:
        raise _refused(rig.name, "has tanh_friction for friction that does not stick")
    joint.stiffness = float(model.jnt_stiffness[0])
    joint.spring_at = float(model.qpos_spring[0])
    muscles = np.zeros(len(rig.muscles), dtype=MUSCLE).view(np.recarray)
    for row, (name, muscle) in zip(muscles, rig.muscles.items(), strict=True):
        tendon = model.tendon(rig.file.tendons[name]).id
        first = int(model.tendon_adr[tendon])
        if model.tendon_num[tendon] != 1 or int(model.wrap_type[first]) != _ON_JOINT:
            raise _refused(rig.name, f"needs {name} on a fixed tendon of the joint")
        row.arm = float(model.wrap_prm[first])
        _write_muscle(row, muscle, f"{rig.name}, {name}")
    for name, (group, fields) in _SHARED.items():
        stated = {
            tuple(getattr(getattr(m, group), field) for field in fields.values())
            for m in rig.muscles.values()
        }
        if len(stated) != 1:
            raise _refused(rig.name, f"has one {name} for all muscles")
        for field, value in zip(fields, *stated, strict=True):
            joint[field] = value
    lines = {(m.valve.supply_line, m.valve.supply_pressure) for m in rig.muscles.values()}
    if float(joint.refill[0] + joint.refill_square[0]) > 0.0 and len(lines) != 1:
        raise _refused(rig.name, "has one supply for all muscles")
    return Numbers(joint=joint, muscles=muscles)


def _write_muscle(row: Record, muscle: object, where: str) -> None:
    """Copy a muscle's parameters into its record."""
    groups = {f.name: getattr(muscle, f.name) for f in dataclasses.fields(muscle)}  # pyright: ignore[reportArgumentType]
    force, loop = groups["force"], groups["hysteresis"]
    if force.law not in _FORCES:
        raise _refused(where, f"has no force law {force.law!r}")
    row.law = float(_FORCES.index(force.law))
    for name in ("scale", "a", "b", "c", "d", "e", "f"):
        setattr(row, name, getattr(force, name, 0.0))
    row.loop_yield, row.loop_sigma, row.loop_sharpness = 1.0, 0.5, 1.0
    if loop is not None:
        if loop.law != "bouc_wen":
            raise _refused(where, f"has no hysteresis {loop.law!r}")
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
                raise _refused(where, f"has no {group}.{field.name}")


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

_GROUPS = {
    "mounting": "length_at_zero",
    "braid": "nominal_length diameter fibre_angle extensibility braid_rub=friction",
    "passive": "passive_stiffness=stiffness passive_softening=softening passive_locking=locking"
    " passive_slack=slack_contraction",
    "threshold": "threshold=pressure",
    "end_shape": "end_loss=loss end_onset=onset",
    "creep": "creep_0=stiffness creep_time_0=relaxation_time",
    "softening": "ageing=share ageing_time=time",
    "chamber": "polytropic=polytropic_index temperature dead_volume atmosphere"
    " leak=leak_conductance",
    "valve": "fill_conductance=conductance_fill exhaust_conductance=conductance_exhaust"
    " critical=critical_ratio laminar=laminar_ratio supply=supply_pressure band=regulator_band"
    " dead_band=regulator_dead_band lag=line_lag delay",
    "chain": "compliance compliance_time=relaxation_time teeth=ripple teeth_pitch=ripple_pitch"
    " teeth_phase=ripple_phase",
    "friction": "brake=stribeck_force brake_speed=stribeck_velocity rub=coulomb_force"
    " rub_static=breakaway_force rub_share=tension_share rub_travel=presliding"
    " rub_time=bristle_time",
}
_COPIED = {
    field: (group, name or field)
    for group, names in _GROUPS.items()
    for field, _, name in (pair.partition("=") for pair in names.split())
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
    carrier = int(m.jnt_bodyid[0])
    moving: set[int] = set()
    for body in range(1, int(m.nbody)):
        parent = int(m.body_parentid[body])
        origin, turned = place[parent]
        there = _rotation(m.body_quat[body])
        place[body] = (origin + turned @ m.body_pos[body], turned @ there)
        if parent in moving or body == carrier:
            moving.add(body)
    origin, turned = place[carrier]
    axis = turned @ m.jnt_axis[0]
    axis = axis / math.sqrt(float(axis @ axis))
    hinge = origin + turned @ m.jnt_pos[0]
    inertia, moment = 0.0, np.zeros(3)
    for body in moving:
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
