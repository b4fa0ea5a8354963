"""Write a rig folder to start from: a template, or the joints and tendons of an existing MJCF.

Every group and field that a muscle can have is in the file, at its neutral value where that means
an effect that is off, so that a user changes numbers and adds none.
"""

from __future__ import annotations

import dataclasses
import json
import math
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from importlib import resources
from pathlib import Path

import mujoco
import numpy as np

from pamsim.core.errors import InputError, PamsimError, nearest
from pamsim.core.files import complete_file, refuse_existing
from pamsim.core.parameters import FieldSpec, ParameterGroup, specs
from pamsim.core.units import COMMON, to_si
from pamsim.engine.mjcf import read_text, recorded_joints
from pamsim.engine.mjcf_fields import native_field
from pamsim.engine.rig import load_rig
from pamsim.physics.force_laws.effective_area import EffectiveArea
from pamsim.physics.force_laws.mckibben import IdealMcKibben
from pamsim.physics.hysteresis.bouc_wen import BoucWen
from pamsim.physics.muscle import MUSCLE_GROUPS, MUSCLE_ONLY, PLAIN_GROUPS
from pamsim.recordings.rig_file import SCHEMA
from pamsim.recordings.sensors import MeasurementChain

KINDS = {
    "joint": "One joint that turns, two muscles that pull on it from both sides",
    "leg": "Hip and knee under gravity, two muscles at each",
    "bench": "One muscle that lifts a weight along a rail",
    "bellows": "One joint that turns, two bellows that push on it from both sides",
}
"""Template -> what it is."""

_WORKING_RANGE = 0.25
"""Contraction of a muscle where its tendon is shortest; it is 0 where the tendon is longest."""

_SHORTEST_STROKE = 0.5
"""Stroke of a bellows where its tendon is shortest, over that at which its wall is free."""

_LENGTH_STEP = 0.005  # of an assumed muscle length [m]
_STOPS_WITHIN = 0.15
"""Time constant of free motion where the MJCF states no damping [s]; 0.03 to 0.2 s in the rigs that
ship."""

_POSES = 400
_UNLIMITED = {mujoco.mjtJoint.mjJNT_HINGE: 0.5, mujoco.mjtJoint.mjJNT_SLIDE: 0.05}
"""Half of the range that a joint without limits is taken to have [rad, m]."""

_OF_MAS20 = "of the order of a 20 mm fluidic muscle, see models/mas20_arm"
_ASSUMED: Mapping[str, tuple[float, str, str]] = {
    "braid.diameter": (20, "mm", "the muscle's inner diameter, from its data sheet"),
    "braid.fibre_angle": (25, "deg", "usual for braided muscles, 20 to 30 deg"),
    "passive.stiffness": (9000, "N", _OF_MAS20),
    "passive.softening": (30, "1", _OF_MAS20),
    "passive.locking": (25, "1", _OF_MAS20),
    "chamber.polytropic_index": (1.2, "1", "between isothermal and adiabatic"),
    "chamber.temperature": (293.15, "K", "room temperature"),
    "chamber.dead_volume": (10, "cm^3", "fittings and half a metre of 4 mm tube"),
    "valve.conductance_fill": (0.05, "dm^3/(s*bar)", "a small valve; data sheet, ISO 6358"),
    "valve.conductance_exhaust": (0.05, "dm^3/(s*bar)", "as to fill"),
    "valve.critical_ratio": (0.3, "1", "typical of small valves, ISO 6358"),
    "valve.supply_pressure": (600, "kPa", "usual in labs"),
    "hysteresis.yield_contraction": (0.5, "percent", "loops turn over within a few millimetres"),
    "stroke.damping": (20, "N*s/m", "of the order of a printed bellows, see models/equimus_leg"),
    "force.area": (
        4,
        "cm^2",
        "effective area, from a data sheet or a force at a known pressure",
    ),
    "force.stiffness": (1000, "N/m", "models/equimus_leg at a fifth of its length; 0: a piston"),
}
"""Field without a neutral value, or with one at which nothing can be fitted -> value, unit, why."""


def new_rig(
    name: str,
    kind: str = "",
    *,
    mjcf: str | os.PathLike[str] | None = None,
    pushing: bool = False,
    out: str | os.PathLike[str] | None = None,
    force: bool = False,
) -> Path:
    """Write a rig folder to start from.

    Args:
        name: of the rig.
        kind: template, one of `KINDS`; not with ``mjcf``.
        mjcf: an existing model without actuators; each of its tendons gets a muscle. If it lies in
            the folder ``out`` it stays where it is, otherwise it is copied.
        pushing: whether its tendons get bellows or pistons, which push, instead of muscles; only
            with ``mjcf``.
        out: folder to write; one named as the rig if left out.
        force: replace files that are there.

    Returns:
        The folder.

    Raises:
        InputError: for a name, kind or MJCF that makes no rig, or a file that is there already.
    """
    if not re.fullmatch(r"\w[\w-]*", name):
        raise InputError(f"{name!r} is no name for a rig; use letters, digits, _ and -")
    if (mjcf is None) == (not kind):
        raise InputError(f"give a `kind` ({', '.join(KINDS)}) or an `mjcf`")
    if kind and pushing:
        raise InputError("`pushing` goes with an `mjcf`; a kind that pushes is bellows")
    folder = Path(out or name)
    pushing = pushing or kind == "bellows"
    if mjcf is None:
        if kind not in KINDS:
            raise InputError(f"no kind {kind!r}; {nearest(kind, KINDS)}")
        text = _template(f"{kind}.xml", NAME=name)
        target, source = folder / f"{name}.xml", "assumed"
        model = _compiled(lambda: mujoco.MjModel.from_xml_string(text), str(target))
    else:
        given = Path(mjcf)
        target, source = folder / given.name, given.name
        if not given.is_file():
            raise InputError(f"no MJCF at {given}")
        text = read_text(given)
        model = _compiled(lambda: mujoco.MjModel.from_xml_path(str(given)), str(given))
        in_place = target.is_file() and target.samefile(given)
        if not in_place and re.search(r"<include\b|\bfile\s*=", text):
            raise InputError(
                f"{given} refers to other files, so it cannot be copied alone; give its own folder"
                " as `out`"
            )
        text = "" if in_place else text
    what = KINDS.get(kind, f"A rig made from {source}")
    scene = "" if mjcf else _template("scene.xml", NAME=name, MJCF=target.name)
    files = {
        target: text,
        folder / "scene.xml": scene,
        folder / "params.toml": _params(
            name, what, target, model, source, scene=bool(scene), pushing=pushing
        ),
        folder / "README.md": _template("README.md", NAME=name, MJCF=target.name, WHAT=what),
    }
    wanted = {path: content for path, content in files.items() if content}
    for path in wanted:
        refuse_existing(path, force)
    there = {path for path in wanted if path.exists()}
    for path, content in wanted.items():
        with complete_file(path) as part:
            part.write_text(content, encoding="utf-8")
    try:
        load_rig(folder)
    except PamsimError:
        for path in set(wanted) - there:
            path.unlink()
        raise
    return folder


def _template(file: str, **words: str) -> str:
    text = (resources.files("pamsim") / "data" / "new_rig" / file).read_text(encoding="utf-8")
    for word, meant in words.items():
        text = text.replace(word, meant)
    return text


def _compiled(load: Callable[[], mujoco.MjModel], where: str) -> mujoco.MjModel:
    """A model, refused with what would make a rig of it."""
    try:
        model = load()
    except ValueError as error:
        raise InputError(f"{where}: {' '.join(str(error).split())}") from None
    if model.nu:
        raise InputError(
            f"{where}: a rig's MJCF holds no actuators of its own; remove <actuator>, each tendon"
            f" gets a muscle (found {model.actuator(0).name!r})"
        )
    if not model.ntendon:
        raise InputError(
            f"{where}: no tendon to put a muscle on; add one for each, such as <tendon><fixed"
            ' name="flexor"><joint joint="knee" coef="-0.02"/></fixed></tendon>'
        )
    names = [model.tendon(i).name for i in range(model.ntendon)]
    names += [model.joint(i).name for i in range(model.njnt)]
    for name in names:
        if not re.fullmatch(r"\w[\w-]*", name):
            raise InputError(
                f"{where}: {name!r} is no name for a tendon or joint of a rig; name each by"
                " letters, digits, _ and -"
            )
    return model


def _params(
    name: str,
    what: str,
    mjcf: Path,
    model: mujoco.MjModel,
    source: str,
    *,
    scene: bool,
    pushing: bool,
) -> str:
    """Text of ``params.toml``."""
    tendons = {_muscle(model.tendon(i).name): i for i in range(model.ntendon)}
    joints = recorded_joints(model, (), [model.tendon(i).name for i in tendons.values()], mjcf)
    loads = [model.body(i).name for i in range(model.nbody) if model.body(i).name == "load"]
    lines = [
        "# Every number has value, unit and source. Replace what is assumed by data sheets and",
        "# measurements, or let `pamsim calibrate` fit it. A value of 0 is an effect that is off.",
        f'schema = "{SCHEMA}"',
        "",
        "[rig]",
        f'name = "{name}"',
        f"purpose = {json.dumps(what)}",
        f'mjcf = "{mjcf.name}"',
        *(['scene = "scene.xml"  # with light, for pictures'] if scene else []),
        f"joints = {json.dumps(list(joints))}  # whose positions are recorded",
        *(f'load_body = "{body}"  # of 1 kg in the MJCF; load_kg of a trial' for body in loads),
    ]
    spans = _tendon_spans(model)
    for muscle, index in tendons.items():
        lines += [
            "",
            f"[muscles.{muscle}]",
            f'tendon = "{model.tendon(index).name}"',
            *_lengths(muscle, model, index, spans[index], pushing=pushing),
        ]
    lines += ["", "# What all of them share; [muscles.NAME.<group>] holds what differs in one."]
    groups = (*MUSCLE_GROUPS, IdealMcKibben, BoucWen)
    if pushing:
        kept = (group for group in PLAIN_GROUPS if group not in MUSCLE_ONLY)
        groups = (*kept, EffectiveArea, BoucWen)
    for group in groups:
        if fields := list(_fields(group)):
            law = [f'law = "{group.law}"'] if group.law else []
            lines += ["", f"[muscle.{group.group}]", *law, *fields]
    lines += ["", "[native]  # fields of the MJCF", *_natives(model, joints, source)]
    lines += ["", "[sensor]", *_fields(MeasurementChain)]
    return "\n".join(lines) + "\n"


def _lengths(
    name: str, model: mujoco.MjModel, tendon: int, span: tuple[float, float], *, pushing: bool
) -> list[str]:
    """Lines on the length of a muscle, or the stroke of a bellows, on a tendon."""
    shortest, longest = span
    middle = 0.5 * (shortest + longest)
    fixed = model.wrap_type[model.tendon_adr[tendon]] == mujoco.mjtWrap.mjWRAP_JOINT
    if not pushing:
        wanted = math.ceil((longest - shortest) / _WORKING_RANGE / _LENGTH_STEP) * _LENGTH_STEP
        nominal = max(wanted if fixed else min(wanted, longest), _LENGTH_STEP)
        at_zero = nominal - longest
        why = "so that the muscle has its nominal length where the tendon is longest"
        contracted = 100 * (longest - shortest) / nominal
        size = f"{contracted:.0f} % contracted where its tendon is shortest"
    elif fixed:
        nominal = max(middle - shortest, _LENGTH_STEP) / (1.0 - _SHORTEST_STROKE)
        at_zero = nominal - middle
        why = f"{_SHORTEST_STROKE:g} of its free stroke where its tendon is shortest"
        size = "free in the middle of its way"
    else:
        nominal, at_zero = middle, 0.0
        why, size = "the length from pin to pin", "free in the middle of its way"
    return [
        f"[muscles.{name}.mounting]",
        _entry("length_at_zero", at_zero, "mm", "m", f"assumed: {why}"),
        f"[muscles.{name}.{'stroke' if pushing else 'braid'}]",
        _entry("nominal_length", nominal, "mm", "m", f"assumed: {size}"),
    ]


def _muscle(tendon: str) -> str:
    """Name of the muscle on a tendon."""
    return re.sub(r"_(cable|tendon)$", "", tendon)


def _fields(group: type[ParameterGroup]) -> Iterator[str]:
    """Line of each field of a group but those that each muscle has of its own."""
    defaults = {field.name: field.default for field in dataclasses.fields(group)}
    for name, spec in specs(group):
        if f"{group.group}.{name}" in _ASSUMED:
            value, unit, why = _ASSUMED[f"{group.group}.{name}"]
            value, source = to_si(value, unit, spec.unit, where=name), f"assumed: {why}"
        elif isinstance(default := defaults[name], float):
            value, unit = default, COMMON.get(spec.unit, spec.unit)
            source = "assumed: off" if value == 0.0 else "assumed: usual"
        else:
            continue
        yield f"{_entry(name, value, unit, spec.unit, source)}  # {spec.doc}"


def _natives(model: mujoco.MjModel, joints: Iterable[str], source: str) -> Iterator[str]:
    """Lines of the MJCF's numbers that effects and calibrations change."""

    def line(name: str, value: float, why: str) -> str:
        spec: FieldSpec = native_field(model, name)
        unit = COMMON.get(spec.unit, spec.unit)
        return f"{_entry(json.dumps(name), value, unit, spec.unit, why)}  # {spec.doc}"

    for joint in joints:
        view = model.joint(joint)
        damping = float(view.damping[0])
        if damping > 0.0:
            yield line(f"joint.{joint}.damping", damping, source)
        else:
            inertia = float(f"{float(model.dof_M0[int(view.dofadr[0])]) / _STOPS_WITHIN:.2g}")
            yield line(
                f"joint.{joint}.damping",
                inertia,
                f"assumed: motion stops within some {_STOPS_WITHIN:g} s",
            )
        for field, value in (
            ("frictionloss", view.frictionloss[0]),
            ("armature", view.armature[0]),
            ("stiffness", view.stiffness[0]),
        ):
            yield line(f"joint.{joint}.{field}", float(value), source)
    for tendon in range(model.ntendon):
        first, count = int(model.tendon_adr[tendon]), int(model.tendon_num[tendon])
        for wrap in range(first, first + count):
            if model.wrap_type[wrap] == mujoco.mjtWrap.mjWRAP_JOINT:
                own = f"_{model.joint(int(model.wrap_objid[wrap])).name}" if count > 1 else ""
                name = f"tendon.{model.tendon(tendon).name}.coef{own}"
                yield line(name, abs(float(model.wrap_prm[wrap])), source)
    tilted = _tilted(model, next(iter(joints)))
    if tilted:
        yield line(f"body.{tilted}.tilt", 0.0, source)


def _tilted(model: mujoco.MjModel, joint: str) -> str:
    """A body that stands still, as the MJCF's frame does, and carries a joint; or none."""
    body = int(model.joint(joint).bodyid[0])
    while body and model.body_weldid[body]:
        body = int(model.body_parentid[body])
    upright = bool(body) and np.array_equal(model.body_quat[body], (1.0, 0.0, 0.0, 0.0))
    return model.body(body).name if upright else ""


def _tendon_spans(model: mujoco.MjModel) -> list[tuple[float, float]]:
    """Least and greatest length of each tendon over the ranges of the joints [m]."""
    rng = np.random.default_rng(0)
    data = mujoco.MjData(model)
    start = data.qpos.copy()
    ends: dict[int, tuple[float, float]] = {}
    for joint in range(model.njnt):
        half = _UNLIMITED.get(mujoco.mjtJoint(int(model.jnt_type[joint])))
        if half is not None:
            address = int(model.jnt_qposadr[joint])
            limited = bool(model.jnt_limited[joint])
            low, high = model.jnt_range[joint] if limited else start[address] + (-half, half)
            ends[address] = (float(low), float(high))
    lengths = []
    for _ in range(_POSES):
        data.qpos[:] = start
        for address, (low, high) in ends.items():
            # The ends as often as all that lies between: there most tendons are longest.
            share = min(max(rng.uniform(-1.0, 2.0), 0.0), 1.0)
            data.qpos[address] = low + share * (high - low)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_tendon(model, data)
        lengths.append(data.ten_length.copy())
    table = np.array(lengths)
    return list(zip(table.min(axis=0).tolist(), table.max(axis=0).tolist(), strict=True))


def _entry(key: str, value: float, unit: str, si_unit: str, source: str) -> str:
    """A line of ``params.toml``, the value given in SI."""
    shown = value / to_si(1.0, unit, si_unit, where=key)
    return f'{key} = {{ value = {shown:.6g}, unit = "{unit}", source = "{source}" }}'
