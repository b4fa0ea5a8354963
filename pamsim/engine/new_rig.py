"""Write a rig folder to start from: a template, or the joints and tendons of an existing MJCF.

Every group and field that a muscle can have is in the file, at its neutral value where that means
an effect that is off, so that a user changes numbers and adds none.
"""

from __future__ import annotations

import json
import math
import os
import re
import string
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from pamsim.core.errors import InputError, PamsimError, nearest
from pamsim.core.files import complete_file, refuse_existing
from pamsim.core.parameters import FieldSpec, ParameterGroup, specs
from pamsim.core.units import COMMON, to_si
from pamsim.engine.attach import compile_model
from pamsim.engine.mjcf import posed, read_spec, read_text, recorded_joints, scalar_joints
from pamsim.engine.mjcf_fields import native_field, native_value, radii
from pamsim.engine.parameter_names import sensor_specs
from pamsim.engine.rig import load_rig
from pamsim.physics.force_laws.effective_area import EffectiveArea
from pamsim.physics.force_laws.mckibben import IdealMcKibben
from pamsim.physics.hysteresis.bouc_wen import BoucWen
from pamsim.physics.muscle import MUSCLE_ONLY, PLAIN_GROUPS, PUSHING_ONLY
from pamsim.recordings.rig_file import SCHEMA
from pamsim.recordings.rig_writer import references
from pamsim.recordings.sensors import MeasurementChain

KINDS = {
    "joint": "One joint that turns, two muscles that pull on it from both sides",
    "leg": "Hip and knee under gravity, two muscles at each",
    "bench": "One muscle that lifts a weight along a rail",
    "bellows": "One joint that turns, two bellows that push on it from both sides",
}
"""Template -> what it is."""

_WORKING_RANGE = 0.25  # contraction where the tendon is shortest; 0 where it is longest
_SHORTEST_STROKE = 0.5  # of a bellows where its tendon is shortest, over the one of its free wall
_LENGTH_STEP = 0.005  # of an assumed muscle length [m]
# Time constant of free motion where the MJCF states no damping [s]; 0.03 to 0.2 s in the rigs that
# ship.
_STOPS_WITHIN = 0.15
_POSES = 400
_NAME = r"\w[\w-]*"


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
    if not re.fullmatch(_NAME, name):
        raise InputError(f"{name!r} is no name for a rig; use letters, digits, _ and -")
    if (mjcf is None) == (not kind):
        both = " and not both" if kind else ""
        raise InputError(f"give a `kind` ({', '.join(KINDS)}) or an `mjcf`{both}")
    if kind and pushing:
        raise InputError("`pushing` goes with an `mjcf`; a kind that pushes is bellows")
    if kind and kind not in KINDS:
        raise InputError(f"no kind {kind!r}; {nearest(kind, KINDS)}")
    folder, files = Path(out or name), dict[Path, str]()
    if mjcf is None:
        target, source, what = folder / f"{name}.xml", "assumed", KINDS[kind]
        files[target] = _template(f"{kind}.xml", NAME=name)
        files[folder / "scene.xml"] = _template("scene.xml", NAME=name, MJCF=target.name)
        model = mujoco.MjModel.from_xml_string(files[target])
    else:
        given = Path(mjcf)
        if not given.is_file():
            raise InputError(f"no MJCF at {given}")
        target, source, what = folder / given.name, given.name, f"A rig made from {given.name}"
        text = read_text(given)
        model = compile_model(read_spec(given))
        _require_names(model, given)
        if not (target.is_file() and target.samefile(given)):
            files[target] = text
            if references(given):
                raise InputError(
                    f"{given} refers to other files, so it cannot be copied alone; give its own"
                    " folder as `out`"
                )
    words = {"NAME": name, "MJCF": target.name, "WHAT": what}
    files[folder / "params.toml"] = _params(words, model, source, pushing or kind == "bellows")
    files[folder / "README.md"] = _template("README.md", **words)
    for path in files:
        refuse_existing(path, force)
    fresh = [path for path in files if not path.exists()]
    for path, content in files.items():
        with complete_file(path) as part:
            part.write_text(content, encoding="utf-8")
    try:
        load_rig(folder)
    except PamsimError:
        for path in fresh:
            path.unlink()
        raise
    return folder


def _template(file: str, **words: str) -> str:
    text = (resources.files("pamsim") / "data" / "new_rig" / file).read_text(encoding="utf-8")
    for word, meant in words.items():
        text = text.replace(word, meant)
    return text


def _require_names(model: mujoco.MjModel, mjcf: Path) -> None:
    """Refuse a model without tendons, or with names that ``params.toml`` cannot hold."""
    if not model.ntendon:
        raise InputError(
            f"{mjcf}: no tendon to put a muscle on; add one for each, such as <tendon><fixed"
            ' name="flexor"><joint joint="knee" coef="-0.02"/></fixed></tendon>'
        )
    for name in (*_tendons(model), *(model.joint(i).name for i in range(model.njnt))):
        if not re.fullmatch(_NAME, name):
            raise InputError(
                f"{mjcf}: {name!r} is no name for a tendon or joint of a rig; name each by"
                " letters, digits, _ and -"
            )


def _tendons(model: mujoco.MjModel) -> list[str]:
    return [model.tendon(index).name for index in range(model.ntendon)]


def _params(words: Mapping[str, str], model: mujoco.MjModel, source: str, pushing: bool) -> str:
    """Text of ``params.toml``."""
    tendons = _tendons(model)
    joints = recorded_joints(model, (), tendons, Path(words["MJCF"]))
    spans = zip(_muscle_keys(tendons), tendons, *_spans(model), strict=True)
    idle, force = (MUSCLE_ONLY, EffectiveArea) if pushing else (PUSHING_ONLY, IdealMcKibben)
    groups = [*(group for group in PLAIN_GROUPS if group not in idle), force, BoucWen]
    assumed = tomllib.loads(_template("assumed.toml"))
    loads = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "load") >= 0
    return string.Template(_template("params.toml")).substitute(
        schema=SCHEMA,
        name=words["NAME"],
        purpose=json.dumps(words["WHAT"]),
        mjcf=words["MJCF"],
        scene='scene = "scene.xml"  # with light, for pictures\n' if source == "assumed" else "",
        joints=json.dumps(list(joints)),
        load='load_body = "load"  # of 1 kg in the MJCF; load_kg of a trial\n' if loads else "",
        muscles="".join(_muscle(model, *span, pushing=pushing) for span in spans),
        shared="".join(_section(f"muscle.{group.group}", group, assumed) for group in groups),
        natives="".join(_natives(model, joints, source)),
        sensor=_section("sensor", MeasurementChain, {}, sensor_specs(joints.values())),
    )


def _muscle_keys(tendons: Sequence[str]) -> list[str]:
    """Muscles' names as TOML takes them: the tendons', without an ending if all then differ."""
    short = [re.sub(r"_(cable|tendon)$", "", tendon) for tendon in tendons]
    names = short if all(short) and len({*short}) == len(short) else tendons
    return [name if name.isascii() else json.dumps(name, ensure_ascii=False) for name in names]


def _muscle(
    model: mujoco.MjModel,
    key: str,
    tendon: str,
    shortest: float,
    longest: float,
    *,
    pushing: bool,
) -> str:
    """Sections of a muscle, or a bellows, on a tendon of least and greatest lengths [m]."""
    middle, stroke = 0.5 * (shortest + longest), longest - shortest
    fixed = bool(radii(model, model.tendon(tendon).id))
    why, size = "the length from pin to pin", "free in the middle of its way"
    if not pushing:
        wanted = math.ceil(stroke / _WORKING_RANGE / _LENGTH_STEP) * _LENGTH_STEP
        nominal = max(wanted if fixed else min(wanted, longest), _LENGTH_STEP)
        at_zero = nominal - longest
        why = "so that the muscle has its nominal length where the tendon is longest"
        size = f"{100 * stroke / nominal:.0f} % contracted where its tendon is shortest"
    elif fixed:
        nominal = max(0.5 * stroke, _LENGTH_STEP) / (1.0 - _SHORTEST_STROKE)
        at_zero = nominal - middle
        why = f"{_SHORTEST_STROKE:g} of its free stroke where its tendon is shortest"
    else:
        nominal, at_zero = middle, 0.0
    name = f"muscles.{key}"
    return f"""
[{name}]
tendon = "{tendon}"
[{name}.mounting]
{_entry("length_at_zero", at_zero, "m", f"assumed: {why}")}
[{name}.{"stroke" if pushing else "braid"}]
{_entry("nominal_length", nominal, "m", f"assumed: {size}")}
"""


def _section(
    head: str,
    group: type[ParameterGroup],
    assumed: Mapping[str, Any],
    fields: Mapping[str, FieldSpec] | None = None,
) -> str:
    """Section of all fields of a group but those that each muscle has of its own, if any."""
    lines = [f'law = "{group.law}"\n'] if group.law else []
    stated = assumed.get(group.group, {})
    for name, spec in (fields or dict(specs(group))).items():
        value, unit = getattr(group, name, None), ""
        source = "usual" if value else "off"
        if name in stated:
            unit, source = stated[name]["unit"], stated[name]["source"]
            value = to_si(stated[name]["value"], unit, spec.unit, where=name)
        if value is not None:
            line = _entry(name, value, spec.unit, f"assumed: {source}", unit)
            lines.append(f"{line}  # {spec.doc}\n")
    return f"\n[{head}]\n{''.join(lines)}" if lines else ""


def _natives(model: mujoco.MjModel, joints: Iterable[str], source: str) -> Iterator[str]:
    """Lines of the MJCF's numbers that effects and calibrations change."""
    fields = ("damping", "frictionloss", "armature", "stiffness")
    names = [f"joint.{joint}.{field}" for joint in joints for field in fields]
    for index, tendon in enumerate(_tendons(model)):
        over = radii(model, index)
        own = [f"_{joint}" for joint in over] if len(over) > 1 else [""] * len(over)
        names += [f"tendon.{tendon}.coef{ending}" for ending in own]
    if tilted := _tilted(model, next(iter(joints))):
        names.append(f"body.{tilted}.tilt")
    for name in names:
        spec, value, why = native_field(model, name), native_value(model, name), source
        if name.endswith(".damping") and value == 0.0:
            dof = int(model.joint(name.split(".")[1]).dofadr[0])
            value = float(f"{float(model.dof_M0[dof]) / _STOPS_WITHIN:.2g}")
            why = f"assumed: motion stops within some {_STOPS_WITHIN:g} s"
        yield f"{_entry(json.dumps(name), value, spec.unit, why)}  # {spec.doc}\n"


def _tilted(model: mujoco.MjModel, joint: str) -> str:
    """A body that stands still, as the MJCF's frame does, and carries a joint; or none."""
    body = int(model.joint(joint).bodyid[0])
    while body and model.body_weldid[body]:
        body = int(model.body_parentid[body])
    upright = bool(body) and np.array_equal(model.body_quat[body], (1.0, 0.0, 0.0, 0.0))
    return model.body(body).name if upright else ""


def _spans(model: mujoco.MjModel) -> tuple[list[float], list[float]]:
    """Least and greatest length of each tendon over the ranges of the joints [m]."""
    # The ends as often as all that lies between: there most tendons are longest.
    shares = np.random.default_rng(0).uniform(-1.0, 2.0, (_POSES, len(scalar_joints(model))))
    lengths = [data.ten_length.copy() for data in posed(model, shares.clip(0.0, 1.0))]
    return np.min(lengths, axis=0).tolist(), np.max(lengths, axis=0).tolist()


def _entry(key: str, value: float, si_unit: str, source: str, unit: str = "") -> str:
    """A line of ``params.toml``, the value given in SI."""
    unit = unit or COMMON.get(si_unit, si_unit)
    shown = value / to_si(1.0, unit, si_unit, where=key)
    return f'{key} = {{ value = {shown:.6g}, unit = "{unit}", source = "{source}" }}'
