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
from collections.abc import Iterator, Mapping
from typing import Any

import mujoco
import numpy as np

from pamsim.core.errors import InputError, nearest
from pamsim.core.parameters import FieldSpec, check_value
from pamsim.engine.mjcf import may_collide

# Field, array of the model, unit, unit at a joint that slides, greatest value, meaning.
_TABLE = (
    ("joint.damping", "dof_damping", "N*m*s/rad", "N*s/m", 1e4, "viscous friction of the joint"),
    ("joint.quadratic_damping", "dof_dampingpoly", "N*m*s^2/rad^2", "N*s^2/m^2", 1e6,
     "damping of the joint per square of its speed"),
    ("joint.frictionloss", "dof_frictionloss", "N*m", "N", 1e4, "dry friction of the joint"),
    ("joint.friction_speed", "jnt_user", "rad/s", "m/s", 1e3,
     "speed below which dry friction is proportional to speed; 0 for friction that sticks"),
    ("joint.armature", "dof_armature", "kg*m^2", "kg", 1e4, "inertia on the joint's axis"),
    ("joint.stiffness", "jnt_stiffness", "N*m/rad", "N/m", 1e6, "spring at the joint"),
    ("body.mass", "body_mass", "kg", "", 1e4, "mass of the body"),
    ("body.tilt", "body_quat", "rad", "", math.pi, "turn about the x axis"),
    ("tendon.coef", "wrap_prm", "m", "", 10.0, "radius of the pulley the tendon runs on"),
    ("tendon.damping", "tendon_damping", "N*s/m", "", 1e6, "viscous friction along the tendon"),
    ("tendon.frictionloss", "tendon_frictionloss", "N", "", 1e5, "dry friction along the tendon"),
)  # fmt: skip
_FIELDS = {
    name: (array, FieldSpec(unit=unit, low=low, high=high, low_open=above, doc=doc), sliding)
    for name, array, unit, sliding, high, doc in _TABLE
    for low in [-high if array == "body_quat" else 0.0]
    for above in [array == "wrap_prm"]  # a tendon on a pulley without radius moves nothing
}
"""``element.field`` -> array, unit and range, unit at a joint that slides or empty."""

_COUNTS = {"joint": "njnt", "body": "nbody", "tendon": "ntendon"}
# Fields from which no constant of a model follows.
_FORCES = ("damping", "quadratic_damping", "frictionloss", "friction_speed", "stiffness")
_REFERENCE = (1e-3, 1.0)  # the engine raises the time constant to two of its steps
_IMPEDANCE = (0.9999, 0.9999, 1e-3, 0.5, 2.0)
_SMOOTH = 0.0  # first number of the reference of friction that does not stick: it has no spring
_ROUNDING = 1e-12  # of the components of an orientation
_PASSES = 50  # at most: where friction of one joint loads the next, each pass brings both nearer
_IMPROVEMENT = 1e-12  # of a pass, below which it is the last


def is_native(name: str) -> bool:
    """Whether a name is that of a native parameter; the model need not have the element."""
    return _kind(name)[0] in _FIELDS


def native_field(model: mujoco.MjModel, name: str, *, where: str = "") -> FieldSpec:
    """Unit and range of a native parameter of a compiled model; ``where`` states it, for errors.

    Raises:
        InputError: if the field or the element is unknown.
    """
    return _find(model, name, where)[1]


def native_value(model: mujoco.MjModel, name: str) -> float:
    """Value of a native parameter of a compiled model, in SI.

    Raises:
        InputError: if the field or the element is unknown.
    """
    array, _, rows = _find(model, name)
    numbers = np.ravel(getattr(model, array)[rows])
    if array == "body_quat":
        # Opposite quaternions are one turn.
        return math.remainder(2.0 * math.atan2(numbers[1], numbers[0]), 2.0 * math.pi)
    return abs(float(numbers[0])) if array == "wrap_prm" else float(numbers[0])


def native_names(model: mujoco.MjModel) -> Iterator[str]:
    """Yield the name of every native parameter of a compiled model.

    Radii that differ from joint to joint are named for each. Static bodies have a tilt, if they are
    turned about the x axis alone, moving ones a mass.
    """
    for kind in _FIELDS:
        element, field = kind.split(".")
        for index in range(getattr(model, _COUNTS[element])):
            own, endings = getattr(model, element)(index).name, [""]
            if field == "coef":
                over = radii(model, index)
                same = len({abs(model.wrap_prm[at]) for at in over.values()}) == 1
                endings = [""] if same else [f"_{joint}" for joint in over]
            elif element == "body":
                moves = bool(model.body_weldid[index])
                has_mass = moves and model.body_mass[index] > 0.0
                has_tilt = index and not moves and not _turned_otherwise(model, index)
                endings = [""] * bool(has_mass if field == "mass" else has_tilt)
            yield from (f"{element}.{own}.{field}{ending}" for ending in endings if own)


def set_natives(
    model: mujoco.MjModel,
    values: Mapping[str, float],
    compiled: mujoco.MjModel,
    *,
    data: mujoco.MjData | None = None,
    where: str = "",
) -> None:
    """Set native parameters of a compiled model, with the constants that follow from them.

    Args:
        model: changed in place.
        values: ``element.name.field`` -> value in SI. The inertia of a body follows its mass: it
            keeps its shape.
        compiled: the model as its MJCF has it, which gives the inertia of a kilogram of a body:
            a mass of 0 leaves none in ``model``.
        data: of the model, overwritten; saves making one.
        where: what sets them, for errors.

    Raises:
        InputError: if a field or element is unknown, or a body without mass is given one.
        ParameterError: if a value is out of range.
    """
    for name, value in values.items():
        array, spec, rows = _find(model, name)
        numbers: Any = check_value(name, value, spec)
        if array == "wrap_prm":
            numbers = np.copysign(value, model.wrap_prm[rows])
        elif array == "body_quat":
            numbers = math.cos(value / 2), math.sin(value / 2), 0.0, 0.0
        elif array == "body_mass":
            own = float(compiled.body_mass[rows])
            if own == 0.0 and value > 0.0:
                raise InputError(
                    f"{where or name}: the MJCF gives this body no mass, so that its inertia is"
                    " unknown; give it one there"
                )
            model.body_inertia[rows] = compiled.body_inertia[rows] * (value / own if own else 0.0)
        getattr(model, array)[rows] = numbers
    if any(_kind(name)[0].partition(".")[2] not in _FORCES for name in values):
        mujoco.mj_setConst(model, data or mujoco.MjData(model))
    apply_friction_speed(model)


def copy_natives(source: mujoco.MjModel, target: mujoco.MjModel) -> None:
    """Give a model the native parameters and options of another of the same MJCF."""
    arrays = {array for array, *_ in _FIELDS.values()}
    for name in arrays | {"body_inertia", "dof_solref", "dof_solimp"}:
        getattr(target, name)[:] = getattr(source, name)
    for name in ("timestep", "noslip_iterations", "noslip_tolerance"):
        setattr(target.opt, name, getattr(source.opt, name))
    mujoco.mj_setConst(target, mujoco.MjData(target))


def _kind(name: str) -> tuple[str, str, str]:
    """``element.field`` of a parameter, its element's name, and the joint of a radius or empty."""
    element, _, rest = name.partition(".")
    own, _, field = rest.rpartition(".")
    joint = field.removeprefix("coef_") if field.startswith("coef_") else ""
    return f"{element}.{'coef' if joint else field}", own, joint


def _find(model: mujoco.MjModel, name: str, where: str = "") -> tuple[str, FieldSpec, Any]:
    """Array of a parameter, its unit and range, and where in the array it lies."""
    kind, own, joint = _kind(name)
    if kind not in _FIELDS:
        raise InputError(
            f"{where or name}: {name!r} is no native parameter; write element.name.field with one"
            f" of element.field: {nearest(kind, _FIELDS)}"
        )
    element = kind.partition(".")[0]
    try:
        index = int(getattr(model, element)(own).id)
    except KeyError:
        raise InputError(f"{name}: the model has no {element} {own!r}") from None
    array, spec, slide_unit = _FIELDS[kind]
    if slide_unit and model.jnt_type[index] == mujoco.mjtJoint.mjJNT_SLIDE:
        spec = dataclasses.replace(spec, unit=slide_unit)
    if array == "dof_dampingpoly":
        return array, spec, (model.dof_jntid == index, 0)
    if array.startswith("dof_"):
        return array, spec, model.dof_jntid == index
    if array == "jnt_user":
        if not model.nuser_jnt:
            raise InputError(f"{name}: only models of rigs have it; load one with pamsim.load_rig")
        return array, spec, (index, -1)
    if array == "body_quat" and _turned_otherwise(model, index):
        raise InputError(
            f"{name}: the MJCF turns this body about another axis than x, so that no tilt describes"
            " its orientation; put it into a body that is not turned, and tilt that one"
        )
    if array != "wrap_prm":
        return array, spec, index
    over = radii(model, index)
    if joint and joint not in over:
        raise InputError(f"{name}: the tendon does not run over it; {nearest(joint, over)}")
    places = [over[joint]] if joint else list(over.values())
    if not places:
        raise InputError(f"{name}: the tendon runs over no joint, so it has no radius")
    if len(set(np.abs(model.wrap_prm[places]).tolist())) > 1:
        fields = " and ".join(f"coef_{joint}" for joint in over)
        raise InputError(f"{name}: the pulleys of this tendon differ; write {fields}")
    return array, spec, places


def _turned_otherwise(model: mujoco.MjModel, body: int) -> bool:
    return bool(np.abs(model.body_quat[body, 2:]).max() > _ROUNDING)


def radii(model: mujoco.MjModel, tendon: int) -> dict[str, int]:
    """Joint -> place in ``model.wrap_prm`` of the radius at which a fixed tendon runs over it."""
    first, joints = int(model.tendon_adr[tendon]), {}
    for place in range(first, first + int(model.tendon_num[tendon])):
        if model.wrap_type[place] == mujoco.mjtWrap.mjWRAP_JOINT:
            joints[model.joint(int(model.wrap_objid[place])).name] = place
    return joints


def make_friction_stick(model: mujoco.MjModel) -> None:
    """Let dry friction of joints and tendons hold under load, without creep.

    Settings that the MJCF states itself are kept. In a model with contacts the pass without
    softness is left to its MJCF, because it would change the friction of the contacts too.
    """
    default = mujoco.MjSpec().default.joint
    for reference, impedance in (
        (model.dof_solref, model.dof_solimp),
        (model.tendon_solref_fri, model.tendon_solimp_fri),
    ):
        stated = (reference != default.solref_friction).any(axis=1)
        stated |= (impedance != default.solimp_friction).any(axis=1)
        reference[~stated], impedance[~stated] = _REFERENCE, _IMPEDANCE
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
