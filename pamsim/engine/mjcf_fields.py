"""Rig parameters in the engine's own fields: properties of joints, bodies and tendons.

A name is ``element.name.field``, such as ``joint.shaft.damping`` or ``body.arm.mass``. Some are not
plain fields: ``tendon.NAME.coef``, the radius of the pulley a fixed tendon runs on (its sign, which
the MJCF sets, is kept); ``tendon.NAME.coef_JOINT``, that at one of several joints; and
``body.NAME.tilt``, a turn of a static body about its x axis.

Dry friction sticks only with solver settings of its own. MuJoCo's ``frictionloss`` is a soft
constraint: with its default settings a joint held by 0.5 N m of dry friction creeps by a degree per
second under 0.45 N m. With a short time constant and little softness it creeps by a ten-thousandth
of that, and the solver's last pass without softness (``noslip_iterations``) holds it still.

Friction that does not stick is the same constraint, soft on purpose: below the joint's friction
speed it is proportional to speed, implicitly over the time step, so that no speed is too small. The
friction speed is the last of the joint's user numbers, 0 for friction that sticks.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError, nearest
from pamsim.core.parameters import FieldSpec, check_value
from pamsim.engine.mjcf import may_collide


@dataclass(frozen=True, kw_only=True)
class _Field:
    """A kind of native parameter.

    Attributes:
        array: of the model, whose numbers it is.
        spec: unit and range.
        slide_unit: unit at a joint that slides; empty if it is the same.
    """

    array: str
    spec: FieldSpec
    slide_unit: str = ""


# Field, array of the model, unit, unit at a joint that slides, range, meaning.
_TABLE = (
    ("joint.damping", "dof_damping", "N*m*s/rad", "N*s/m", 0, 1e4, "viscous friction of the joint"),
    ("joint.frictionloss", "dof_frictionloss", "N*m", "N", 0, 1e4, "dry friction of the joint"),
    ("joint.friction_speed", "jnt_user", "rad/s", "m/s", 0, 1e3,
     "speed below which dry friction is proportional to speed; 0 for friction that sticks"),
    ("joint.armature", "dof_armature", "kg*m^2", "kg", 0, 1e4, "inertia on the joint's axis"),
    ("joint.stiffness", "jnt_stiffness", "N*m/rad", "N/m", 0, 1e6, "spring at the joint"),
    ("body.mass", "body_mass", "kg", "", 0, 1e4, "mass of the body"),
    ("body.tilt", "body_quat", "rad", "", -math.pi, math.pi, "turn about the x axis"),
    ("tendon.coef", "wrap_prm", "m", "", 0, 10, "radius of the pulley the tendon runs on"),
    ("tendon.damping", "tendon_damping", "N*s/m", "", 0, 1e6, "viscous friction along the tendon"),
    ("tendon.frictionloss", "tendon_frictionloss", "N", "", 0, 1e5,
     "dry friction along the tendon"),
)  # fmt: skip

_FIELDS = {
    name: _Field(
        array=array,
        spec=FieldSpec(
            unit=unit,
            low=float(low),
            high=float(high),
            low_open=array == "wrap_prm",  # a tendon on a pulley without radius moves nothing
            doc=doc,
        ),
        slide_unit=slide_unit,
    )
    for name, array, unit, slide_unit, low, high, doc in _TABLE
}
"""``element.field`` -> what it is."""

_ELEMENTS = {
    "joint": mujoco.mjtObj.mjOBJ_JOINT,
    "body": mujoco.mjtObj.mjOBJ_BODY,
    "tendon": mujoco.mjtObj.mjOBJ_TENDON,
}

_ARRAYS = (
    *(field.array for field in _FIELDS.values()),
    "body_inertia",
    "dof_solref",
    "dof_solimp",
)
"""Arrays of a compiled model that native parameters change."""

_FORCES = ("damping", "frictionloss", "friction_speed", "stiffness")
"""Fields from which the engine derives no constant of a model."""

_REFERENCE = (1e-3, 1.0)  # the engine raises the time constant to two of its steps
_IMPEDANCE = (0.9999, 0.9999, 1e-3, 0.5, 2.0)
_SMOOTH = 0.0  # first number of the reference of friction that does not stick: it has no spring
_PASSES = 50  # at most: where friction of one joint loads the next, each pass brings both nearer
_IMPROVEMENT = 1e-12  # of a pass, below which it is the last


def is_native(name: str) -> bool:
    """Whether a name is that of a native parameter; the model need not have the element."""
    parts = name.split(".")
    return len(parts) == 3 and _kind(parts) in _FIELDS


def native_field(model: mujoco.MjModel, name: str, *, where: str = "") -> FieldSpec:
    """Unit and range of a native parameter, at a joint that turns or slides, a body or a tendon.

    Args:
        model: compiled.
        name: ``element.name.field``.
        where: what states it, for errors.

    Raises:
        InputError: if the field or the element is unknown.
    """
    field, index = _find(model, name, where or name)
    slides = field.slide_unit and int(model.jnt_type[index]) == mujoco.mjtJoint.mjJNT_SLIDE
    return dataclasses.replace(field.spec, unit=field.slide_unit) if slides else field.spec


def native_value(model: mujoco.MjModel, name: str) -> float:
    """Value of a native parameter of a compiled model, in SI.

    Raises:
        InputError: if the field or the element is unknown.
    """
    field, index = _find(model, name, name)
    if field.array == "body_quat":
        return 2.0 * math.atan2(model.body_quat[index, 1], model.body_quat[index, 0])
    first = float(np.ravel(_numbers(model, name, field, index))[0])
    return abs(first) if field.array == "wrap_prm" else first


def native_names(model: mujoco.MjModel) -> Iterator[str]:
    """Yield the name of every native parameter of a compiled model.

    Radii that differ from joint to joint are named for each. Static bodies have a tilt, moving ones
    a mass.
    """
    for kind in _FIELDS:
        element, field = kind.split(".")
        for index in range(_count(model, element)):
            own = mujoco.mj_id2name(model, _ELEMENTS[element], index)
            name = f"{element}.{own}.{field}"
            if not own or (element == "body" and not _is_of_body(model, index, field)):
                continue
            if field != "coef":
                yield name
            elif model.wrap_type[model.tendon_adr[index]] == mujoco.mjtWrap.mjWRAP_JOINT:
                try:
                    _pulleys(model, name, index)
                except InputError:
                    first = int(model.tendon_adr[index])
                    for wrap in range(first, first + int(model.tendon_num[index])):
                        yield f"{name}_{model.joint(int(model.wrap_objid[wrap])).name}"
                else:
                    yield name


def _is_of_body(model: mujoco.MjModel, index: int, field: str) -> bool:
    if model.body_weldid[index]:
        return field == "mass" and model.body_mass[index] > 0.0
    return field == "tilt" and index > 0


def changes_constants(name: str) -> bool:
    """Whether ``mj_setConst`` is due after a native parameter is set."""
    return name.rpartition(".")[2] not in _FORCES


def set_native(model: mujoco.MjModel, name: str, value: float, compiled: mujoco.MjModel) -> None:
    """Set a native parameter of a compiled model.

    Call ``mj_setConst`` after the last one that `changes_constants`.

    Args:
        model: changed in place.
        name: ``element.name.field``.
        value: in SI.
        compiled: the model as its MJCF has it, which gives the inertia of a kilogram of a body:
            a mass of 0 leaves none in ``model``.

    Raises:
        InputError: if the field or the element is unknown, or a body without mass is given one.
        ParameterError: if the value is out of range.
    """
    field, index = _find(model, name, name)
    check_value(name, value, field.spec)
    if field.array == "body_mass":
        set_mass(model, index, value, compiled, where=name)
        return
    numbers = _numbers(model, name, field, index)
    if field.array == "wrap_prm":
        numbers[:] = np.copysign(value, numbers)
    elif field.array == "body_quat":
        numbers[:] = (math.cos(value / 2), math.sin(value / 2), 0.0, 0.0)
    else:
        numbers[:] = value


def set_mass(
    model: mujoco.MjModel, body: int, mass: float, compiled: mujoco.MjModel, *, where: str
) -> None:
    """Set the mass of a body, with its inertia in proportion: it keeps its shape.

    Args:
        model: changed in place.
        body: its number.
        mass: [kg].
        compiled: see `set_native`.
        where: what sets it, for errors.

    Raises:
        InputError: if the MJCF gives the body no mass.
    """
    own = float(compiled.body_mass[body])
    if own == 0.0 and mass > 0.0:
        raise InputError(
            f"{where}: the MJCF gives this body no mass, so that its inertia is unknown; give it"
            " one there"
        )
    model.body_inertia[body] = compiled.body_inertia[body] * (mass / own if own else 0.0)
    model.body_mass[body] = mass


def copy_natives(source: mujoco.MjModel, target: mujoco.MjModel) -> None:
    """Give a model the native parameters and the time step of another of the same MJCF.

    Args:
        source: read.
        target: changed in place.
    """
    for name in _ARRAYS:
        getattr(target, name)[:] = getattr(source, name)
    target.opt.timestep = source.opt.timestep
    mujoco.mj_setConst(target, mujoco.MjData(target))


def _count(model: mujoco.MjModel, element: str) -> int:
    return {"joint": model.njnt, "body": model.nbody, "tendon": model.ntendon}[element]


def _kind(parts: Sequence[str]) -> str:
    """Element and field of a name's parts, without the joint of a radius."""
    field = "coef" if parts[-1].startswith("coef_") else parts[-1]
    return f"{parts[0]}.{field}"


def _find(model: mujoco.MjModel, name: str, where: str) -> tuple[_Field, int]:
    """Field and element's number that a name stands for."""
    parts = name.split(".")
    kind = _kind(parts)
    if len(parts) != 3 or kind not in _FIELDS:
        raise InputError(
            f"{where}: {name!r} is no native parameter; write element.name.field with one of"
            f" element.field: {nearest(kind, _FIELDS)}"
        )
    element, target, _ = parts
    index = mujoco.mj_name2id(model, _ELEMENTS[element], target)
    if index < 0:
        raise InputError(f"{name}: the model has no {element} {target!r}")
    return _FIELDS[kind], index


def _numbers(model: mujoco.MjModel, name: str, field: _Field, index: int) -> NDArray[np.float64]:
    """The numbers of a parameter, as a view of the model's array."""
    array = getattr(model, field.array)
    if field.array == "wrap_prm":
        return array[_pulleys(model, name, index)]
    if field.array == "jnt_user":
        if not model.nuser_jnt:
            raise InputError(f"{name}: only models of rigs have it; load one with pamsim.load_rig")
        return array[index, -1:]
    if field.array.startswith("dof_"):
        dofs = np.flatnonzero(model.dof_jntid == index)
        return array[dofs[0] : dofs[-1] + 1]
    return array[index] if array.ndim > 1 else array[index : index + 1]


def _pulleys(model: mujoco.MjModel, name: str, tendon: int) -> slice:
    """Where a fixed tendon's radii lie in ``model.wrap_prm``: at one joint, or the same at all."""
    first = int(model.tendon_adr[tendon])
    wraps = range(first, first + int(model.tendon_num[tendon]))
    joints = {model.joint(int(model.wrap_objid[wrap])).name: wrap for wrap in wraps}
    joint = name.rpartition(".")[2].partition("_")[2]
    if joint:
        if joint not in joints:
            raise InputError(f"{name}: the tendon does not run over it; {nearest(joint, joints)}")
        return slice(joints[joint], joints[joint] + 1)
    if len(set(np.abs(model.wrap_prm[wraps]).tolist())) > 1:
        fields = " and ".join(f"coef_{joint}" for joint in joints)
        raise InputError(f"{name}: the pulleys of this tendon differ; write {fields}")
    return slice(wraps.start, wraps.stop)


def make_friction_stick(model: mujoco.MjModel) -> None:
    """Let dry friction of joints and tendons hold under load, without creep.

    Settings that the MJCF states itself are kept. In a model with contacts the pass without
    softness is left to its MJCF, because it would change the friction of the contacts too.

    Args:
        model: changed in place; without dry friction its dynamics are the same.
    """
    for reference, impedance in (
        (model.dof_solref, model.dof_solimp),
        (model.tendon_solref_fri, model.tendon_solimp_fri),
    ):
        _harden(reference, impedance)
    _hold_still(model)


def _hold_still(model: mujoco.MjModel) -> None:
    """Add the pass without softness, unless it is there or the MJCF's to state."""
    if model.opt.noslip_iterations == 0 and not may_collide(model):
        model.opt.noslip_iterations = _PASSES
        model.opt.noslip_tolerance = _IMPROVEMENT


def reserve_friction_speed(spec: mujoco.MjSpec) -> None:
    """Give every joint of a model to be compiled a further user number, 0."""
    own = max((len(joint.userdata) for joint in spec.joints), default=0)
    spec.nuser_jnt = max(spec.nuser_jnt, own) + 1


def apply_friction_speed(model: mujoco.MjModel) -> None:
    """Set the softness of the dry friction of joints to their friction speeds.

    It depends on the time step, the friction and the inertia: call it after any of them changes.

    Args:
        model: of a rig; changed in place.
    """
    step, smooth = float(model.opt.timestep), False
    for joint, speed in enumerate(model.jnt_user[:, -1].tolist() if model.nuser_jnt else ()):
        dof = int(model.jnt_dofadr[joint])
        friction = float(model.dof_frictionloss[dof])
        if speed > 0.0 and friction > 0.0:
            # The engine's force is -(a + B v) / R. With 1/R = c h and B = 1/h that is -c (v + h a),
            # the slope c times the speed after the step.
            share = friction / speed * step * float(model.dof_invweight0[dof])
            impedance = min(max(share / (1.0 + share), mujoco.mjMINIMP), mujoco.mjMAXIMP)
            model.dof_solref[dof] = (_SMOOTH, -impedance / step)
            model.dof_solimp[dof] = (impedance, impedance, *_IMPEDANCE[2:])
            smooth = True
        elif model.dof_solref[dof, 0] == _SMOOTH:
            model.dof_solref[dof], model.dof_solimp[dof] = _REFERENCE, _IMPEDANCE
            _hold_still(model)
    if smooth:
        model.opt.noslip_iterations = 0  # the pass takes all softness away


def _harden(reference: NDArray[np.float64], impedance: NDArray[np.float64]) -> None:
    """Replace the settings that are the engine's defaults."""
    default = mujoco.MjSpec().default.joint
    stated = (reference != default.solref_friction).any(axis=1)
    stated |= (impedance != default.solimp_friction).any(axis=1)
    reference[~stated] = _REFERENCE
    impedance[~stated] = _IMPEDANCE
