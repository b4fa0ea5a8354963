"""Rig parameters stored in the engine's own fields: joint, body and tendon properties.

A name is ``element.name.field``, such as ``joint.shaft.damping`` or ``body.arm.mass``. Some are not
plain fields: ``tendon.NAME.coef``, the radius of the pulley a fixed tendon runs on (its sign, which
the MJCF sets, is kept); ``tendon.NAME.coef_JOINT``, that at one of several joints; and
``body.NAME.tilt``, a turn of a static body about its x axis.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError, nearest
from pamsim.core.parameters import FieldSpec, Sourced, check_value

_FIELDS: dict[str, FieldSpec] = {
    "joint.damping": FieldSpec(
        unit="N*m*s/rad", low=0.0, high=1e4, low_open=False, doc="viscous friction of the joint"
    ),
    "joint.frictionloss": FieldSpec(
        unit="N*m", low=0.0, high=1e4, low_open=False, doc="dry friction of the joint"
    ),
    "joint.friction_speed": FieldSpec(
        unit="rad/s",
        low=0.0,
        high=1e3,
        low_open=False,
        doc="speed below which dry friction is proportional to speed; 0 for friction that sticks",
    ),
    "joint.armature": FieldSpec(
        unit="kg*m^2", low=0.0, high=1e4, low_open=False, doc="inertia on the joint's axis"
    ),
    "joint.stiffness": FieldSpec(
        unit="N*m/rad", low=0.0, high=1e6, low_open=False, doc="spring at the joint"
    ),
    "body.mass": FieldSpec(unit="kg", low=0.0, high=1e4, low_open=False, doc="mass of the body"),
    "body.tilt": FieldSpec(
        unit="rad", low=-math.pi, high=math.pi, low_open=False, doc="turn about the x axis"
    ),
    "tendon.coef": FieldSpec(
        unit="m", low=0.0, high=10.0, low_open=True, doc="radius of the pulley the tendon runs on"
    ),
    "tendon.damping": FieldSpec(
        unit="N*s/m", low=0.0, high=1e6, low_open=False, doc="viscous friction along the tendon"
    ),
    "tendon.frictionloss": FieldSpec(
        unit="N", low=0.0, high=1e5, low_open=False, doc="dry friction along the tendon"
    ),
}

_OF_SLIDE = {
    "joint.damping": "N*s/m",
    "joint.frictionloss": "N",
    "joint.friction_speed": "m/s",
    "joint.armature": "kg",
    "joint.stiffness": "N/m",
}
"""Unit of a field at a joint that slides."""

_COUNTS = {"joint": "jnt", "body": "body", "tendon": "tendon"}
"""Element -> what MuJoCo calls it where it counts them."""

_ARRAYS = (
    "dof_damping",
    "dof_frictionloss",
    "dof_solref",
    "dof_solimp",
    "dof_armature",
    "jnt_user",
    "jnt_stiffness",
    "body_mass",
    "body_inertia",
    "body_quat",
    "tendon_damping",
    "tendon_frictionloss",
    "wrap_prm",
)
"""Fields of a compiled model that native parameters set."""

_FORCES = ("damping", "frictionloss", "friction_speed", "stiffness")
"""Fields from which the engine derives no constant of a model."""


def native_si(model: mujoco.MjModel, name: str, entry: Sourced) -> float:
    """Value of a native parameter in SI.

    Raises:
        InputError: if the field or the element is unknown, or the unit wrong.
    """
    return entry.si(_model_spec(model, name, entry.where).unit)


def is_native(name: str) -> bool:
    """Whether a name is that of a native parameter; the model need not have the element."""
    parts = name.split(".")
    return len(parts) == 3 and _kind(parts) in _FIELDS


def native_field(model: mujoco.MjModel, name: str) -> FieldSpec:
    """Unit and range of a native parameter.

    Raises:
        InputError: if the field or the element is unknown.
    """
    return _model_spec(model, name, name)


def native_value(model: mujoco.MjModel, name: str) -> float:
    """Value of a native parameter of a compiled model, in SI.

    Raises:
        InputError: if the field or the element is unknown.
    """
    element, target, _ = _spec(name, name)
    view = _view(model, name, element, target)
    field = name.rpartition(".")[2]
    if field.startswith("coef"):
        return abs(float(model.wrap_prm[_pulleys(model, name, view.id)[0]]))
    if field == "tilt":
        return 2.0 * math.atan2(model.body_quat[view.id][1], model.body_quat[view.id][0])
    if field == "mass":
        return float(model.body_mass[view.id])
    if field == "friction_speed":
        return float(_user_numbers(model, name)[view.id, -1])
    return float(np.ravel(_plain(model, element, view, field))[0])


def native_names(model: mujoco.MjModel) -> Iterator[str]:
    """Yield the name of every native parameter of a compiled model.

    Radii that differ from joint to joint are named for each. Static bodies have a tilt, moving ones
    a mass.
    """
    for kind in _FIELDS:
        element, field = kind.split(".")
        for index in range(getattr(model, f"n{_COUNTS[element]}")):
            view = getattr(model, element)(index)
            name = f"{element}.{view.name}.{field}"
            if not view.name or (element == "body" and not _is_of_body(model, index, field)):
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


def set_native(model: mujoco.MjModel, name: str, value: float) -> None:
    """Set a native parameter of a compiled model.

    Call ``mj_setConst`` after the last one that `changes_constants`.

    Args:
        model: changed in place.
        name: ``element.name.field``.
        value: in SI.

    Raises:
        InputError: if the field or the element is unknown.
        ParameterError: if the value is out of range.
    """
    element, target, spec = _spec(name, name)
    check_value(name, value, spec)
    field = name.rpartition(".")[2]
    view = _view(model, name, element, target)
    if field.startswith("coef"):
        wraps = _pulleys(model, name, view.id)
        model.wrap_prm[wraps] = np.copysign(value, model.wrap_prm[wraps])
    elif field == "tilt":
        model.body_quat[view.id] = [math.cos(value / 2), math.sin(value / 2), 0.0, 0.0]
    elif field == "friction_speed":
        _user_numbers(model, name)[view.id, -1] = value
    elif field == "mass":
        # The inertia belongs to the same body: it keeps its shape and scales with the mass.
        model.body_inertia[view.id] *= value / model.body_mass[view.id]
        model.body_mass[view.id] = value
    else:
        _plain(model, element, view, field)[:] = value


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


def _plain(model: mujoco.MjModel, element: str, view: Any, field: str) -> NDArray[np.float64]:
    """A field's numbers, to be read or set; views of tendons leave damping and friction out."""
    if element == "tendon":
        return getattr(model, f"tendon_{field}")[view.id : view.id + 1]
    return getattr(view, field)


def _user_numbers(model: mujoco.MjModel, name: str) -> NDArray[np.float64]:
    """The joints' user numbers, of which rigs have at least one."""
    if not model.nuser_jnt:
        raise InputError(f"{name}: only models of rigs have it; load one with pamsim.load_rig")
    return model.jnt_user


def _model_spec(model: mujoco.MjModel, name: str, where: str) -> FieldSpec:
    """A field's unit and range at a joint that turns or slides, a body or a tendon."""
    element, target, spec = _spec(name, where)
    view, kind = _view(model, name, element, target), _kind(name.split("."))
    slides = element == "joint" and int(model.jnt_type[view.id]) == mujoco.mjtJoint.mjJNT_SLIDE
    return dataclasses.replace(spec, unit=_OF_SLIDE[kind]) if slides else spec


def _view(model: mujoco.MjModel, name: str, element: str, target: str) -> Any:
    try:
        return getattr(model, element)(target)
    except KeyError:
        raise InputError(f"{name}: the model has no {element} {target!r}") from None


def _pulleys(model: mujoco.MjModel, name: str, tendon: int) -> list[int]:
    """Indices of a fixed tendon's radii in ``model.wrap_prm``: at one joint, or the same at all."""
    first = int(model.tendon_adr[tendon])
    wraps = list(range(first, first + int(model.tendon_num[tendon])))
    joints = {model.joint(int(model.wrap_objid[wrap])).name: wrap for wrap in wraps}
    joint = name.rpartition(".")[2].partition("_")[2]
    if joint:
        if joint not in joints:
            raise InputError(f"{name}: the tendon does not run over it; {nearest(joint, joints)}")
        return [joints[joint]]
    if len(set(np.abs(model.wrap_prm[wraps]).tolist())) > 1:
        fields = " and ".join(f"coef_{joint}" for joint in joints)
        raise InputError(f"{name}: the pulleys of this tendon differ; write {fields}")
    return wraps


def _kind(parts: Sequence[str]) -> str:
    """Element and field of a name's parts, without the joint of a radius."""
    field = "coef" if parts[-1].startswith("coef_") else parts[-1]
    return f"{parts[0]}.{field}"


def _spec(name: str, where: str) -> tuple[str, str, FieldSpec]:
    parts = name.split(".")
    kind = _kind(parts)
    if len(parts) != 3 or kind not in _FIELDS:
        raise InputError(
            f"{where}: {name!r} is no native parameter; write element.name.field with one of"
            f" element.field: {nearest(kind, _FIELDS)}"
        )
    return parts[0], parts[1], _FIELDS[kind]
