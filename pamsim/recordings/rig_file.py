"""Read a rig: a folder with ``params.toml``, the MJCF it names, and perhaps ``effects.py``.

``effects.py`` adds to the package: it defines ``LAWS``, a sequence of
`pamsim.physics.force_laws.force_law.ForceLaw` and `pamsim.physics.hysteresis.group.Operator`, or
``EFFECTS``, one of `pamsim.effects.effect.Effect`, or both. Reading a rig runs that file: read no
rig whose origin you do not know.
"""

from __future__ import annotations

import functools
import os
import sys
import traceback
import types
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pamsim.core.errors import InputError, PamsimError, nearest
from pamsim.core.parameters import Sourced
from pamsim.core.toml_tables import NUMBER, check_keys, entry, read_toml
from pamsim.effects.effect import Effect
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.force_law import ForceLaw
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.hysteresis.group import Operator

SCHEMA = "pamsim-rig/1"
EFFECTS = "effects.py"

Section = Mapping[str, "Sourced | str"]
"""A TOML table: numbers with their source, and words such as the name of a law."""

_TOP = ("schema", "rig", "muscle", "muscles", "native", "sensor")
_RIG = ("name", "purpose", "mjcf", "scene", "angle_joint", "joints", "load_body")
_NUMBER = ("value", "unit", "source", "interval95", "bounds", "note")


@dataclass(frozen=True, kw_only=True)
class OwnPhysics:
    """Force laws, operators of hysteresis and effects that a rig adds to the package."""

    laws: tuple[ForceLaw, ...] = ()
    operators: tuple[Operator, ...] = ()
    effects: tuple[Effect, ...] = ()


@dataclass(frozen=True, kw_only=True)
class RigFile:
    """A rig as its folder states it.

    Attributes:
        folder: where it lies.
        name: of the rig.
        purpose: what it is and is for, in a sentence; empty if not stated.
        mjcf: path of the device's MJCF.
        scene: path of the MJCF with floor and light, or None.
        joints: whose positions are recorded; none stands for those that the muscles move.
        load_body: body that carries the load, or None.
        tendons: muscle name -> tendon name, in actuator order; of a muscle on a joint that slides,
            the joint's name.
        rods: joints that carry a muscle and get a tendon of their name.
        muscle: shared sections, group -> entries.
        overrides: muscle name -> group -> entries that replace shared ones.
        native: MJCF field, such as ``joint.shaft.damping`` -> value.
        sensor: measurement chain -> value.
        own: what its ``effects.py`` adds to the package.
    """

    folder: Path
    name: str
    purpose: str = ""
    mjcf: Path
    scene: Path | None
    joints: tuple[str, ...]
    load_body: str | None
    tendons: Mapping[str, str]
    rods: tuple[str, ...]
    muscle: Mapping[str, Section]
    overrides: Mapping[str, Mapping[str, Section]]
    native: Mapping[str, Sourced]
    sensor: Mapping[str, Sourced]
    own: OwnPhysics = field(default_factory=OwnPhysics)

    @property
    def operators(self) -> dict[str, Operator]:
        """Hysteresis operators that its muscles may have, by name."""
        return {**OPERATORS, **{one.name: one for one in self.own.operators}}


def shipped_rigs() -> Path:
    """Folder of the rigs that come with pamsim: installed with it, or of the source tree."""
    package = Path(__file__).resolve().parent.parent
    installed = package / "_models"
    return installed if installed.is_dir() else package.parent / "models"


def shipped_rig_names() -> list[str]:
    """Names of the rigs that come with pamsim."""
    return sorted(path.parent.name for path in shipped_rigs().glob("*/params.toml"))


def find_rig(rig: str | os.PathLike[str]) -> Path:
    """Folder of a rig given by the name of a shipped one or by its own path.

    Raises:
        InputError: if there is none, with the nearest name.
    """
    if os.path.isfile(Path(rig) / "params.toml"):
        return Path(rig)
    name, names = str(rig), shipped_rig_names()
    if name in names:
        return shipped_rigs() / name
    raise InputError(
        f"no rig {name!r}: it is neither a folder with params.toml nor a shipped rig;"
        f" {nearest(name, names)}"
    )


def read_rig(rig: str | os.PathLike[str]) -> RigFile:
    """Read a rig's ``params.toml``, and run its ``effects.py`` if it has one.

    Args:
        rig: name of a shipped rig, or path of a rig folder.

    Raises:
        InputError: for a missing file, bad TOML, an unknown or missing key, each with its place.
    """
    folder = find_rig(rig)
    path = folder / "params.toml"
    document = read_toml(path)
    stated = document.get("schema")
    if stated != SCHEMA:
        raise InputError(f"{path}: schema is {stated!r}; this pamsim reads {SCHEMA!r}")
    check_keys(document, _TOP, path)

    def table(key: str, default: object = None) -> Mapping[str, Any]:
        return entry(document, key, Mapping, f"{path}: table [{key}] is missing", default)

    def numbers(key: str) -> dict[str, Sourced]:
        return {name: _number(path, f"{key}.{name}", one) for name, one in table(key, {}).items()}

    head = check_keys(table("rig"), _RIG, path, "rig.")

    def word(key: str, default: str | None = None) -> str:
        return entry(head, key, str, f'{path}: [rig] needs {key} = "..."', default)

    def file(key: str) -> Path:
        if not os.path.isfile(folder / word(key)):
            raise InputError(f"{path}: names {word(key)!r}, which is not in {folder}")
        return folder / word(key)

    muscles = table("muscles")
    places = {name: _place(path, name, one) for name, one in muscles.items()}
    return RigFile(
        folder=folder,
        name=word("name"),
        purpose=word("purpose", ""),
        mjcf=file("mjcf"),
        scene=file("scene") if "scene" in head else None,
        joints=_joints(path, head),
        load_body=word("load_body") if "load_body" in head else None,
        tendons={name: on for name, (_, on) in places.items()},
        rods=tuple(on for kind, on in places.values() if kind == "joint"),
        muscle=_sections(path, "muscle", table("muscle")),
        overrides={
            name: _sections(path, f"muscles.{name}", {k: one[k] for k in one if k != kind})
            for (name, one), (kind, _) in zip(muscles.items(), places.values(), strict=True)
        },
        native=numbers("native"),
        sensor=numbers("sensor"),
        own=read_effects(folder),
    )


def _place(path: Path, name: str, muscle: Any) -> tuple[str, str]:
    """Whether a muscle lies on a ``tendon`` or a ``joint``, and on which."""
    if not isinstance(muscle, Mapping):
        raise InputError(f'{path}: muscles.{name} must be a table: {{ tendon = "..." }}')
    if "tendon" in muscle and "joint" in muscle:
        raise InputError(f"{path}: muscles.{name} names a tendon and a joint; keep one of them")
    kind = "joint" if "joint" in muscle else "tendon"
    return kind, entry(muscle, kind, str, f'{path}: [muscles.{name}] needs {kind} = "..."')


def _joints(path: Path, head: Mapping[str, Any]) -> tuple[str, ...]:
    if "angle_joint" in head:
        if "joints" in head:
            raise InputError(f"{path}: [rig] has angle_joint and joints; keep one of them")
        return (entry(head, "angle_joint", str, f'{path}: [rig] needs angle_joint = "..."'),)
    wanted = f'{path}: [rig] joints must name each recorded joint once: ["hip", "knee"]'
    names: list[Any] = entry(head, "joints", list, wanted, [])
    known = all(isinstance(name, str) for name in names)
    if not known or len(set(names)) < len(names) or ("joints" in head and not names):
        raise InputError(wanted)
    return tuple(names)


def _sections(path: Path, where: str, table: Mapping[str, Any]) -> dict[str, Section]:
    sections: dict[str, Section] = {}
    for group in table:
        place = f"{where}.{group}"
        entries = entry(table, group, Mapping, f"{path}: {place} must be a table of parameters")
        sections[group] = {
            key: one if isinstance(one, str) else _number(path, f"{place}.{key}", one)
            for key, one in entries.items()
        }
    return sections


def _number(path: Path, key: str, table: Any) -> Sourced:
    where = f"{path}: {key}"
    if not isinstance(table, Mapping):
        raise InputError(f'{where} must be {{ value = ..., unit = "...", source = "..." }}')
    check_keys(table, _NUMBER, path, f"{key}.")

    def word(name: str) -> str:
        return entry(
            table, name, str, f'{where} needs {name} = "..."; every number says its {name}'
        )

    def pair(name: str) -> tuple[float, float] | None:
        ends = table.get(name)
        if ends is None:
            return None
        numbers = isinstance(ends, list) and all(isinstance(end, NUMBER) for end in ends)
        if not (numbers and len(ends) == 2 and ends[0] <= ends[1]):
            raise InputError(f"{where}: a range is written [low, high], got {ends!r}")
        return float(ends[0]), float(ends[1])

    return Sourced(
        value=float(entry(table, "value", NUMBER, f"{where}.value = {{!r}} is not a number")),
        unit=word("unit"),
        source=word("source"),
        where=where,
        interval95=pair("interval95"),
        bounds=pair("bounds"),
        note=str(table.get("note", "")),
    )


def add_rigs_laws(rig: str | os.PathLike[str] | None) -> None:
    """Add the laws of a rig, if one is given, to the catalogs; raises as `read_rig`."""
    if rig is not None:
        read_effects(find_rig(rig))


def read_effects(folder: Path) -> OwnPhysics:
    """Run the ``effects.py`` in a rig's folder, if there is one, and add its laws to the catalogs.

    Raises:
        InputError: if the file fails, or holds something else than laws and effects.
    """
    path = folder / EFFECTS
    if not path.is_file():
        return OwnPhysics()
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not UTF-8 text: {error}") from None
    own = _own_physics(path.resolve(), text)
    # Every time: the newest of a name is what the catalogs list, also of two rigs in turn.
    for law in own.laws:
        FORCE_LAWS.add(law, str(path))
    for operator in own.operators:
        OPERATORS.add(operator, str(path))
    return own


@functools.cache
def _own_physics(path: Path, text: str) -> OwnPhysics:
    # A module, so that its classes know where they come from; no cached bytecode beside the rig.
    module = types.ModuleType(f"pamsim_rig_{zlib.crc32(str(path).encode()):08x}")
    module.__file__ = str(path)
    sys.modules[module.__name__] = module
    try:
        exec(compile(text, str(path), "exec"), module.__dict__)
    except PamsimError as error:
        raise InputError(f"{path}: {error}") from None
    except Exception as error:  # whatever the rig's own code raises
        frames = traceback.extract_tb(error.__traceback__)
        lines = [frame.lineno for frame in frames if frame.filename == str(path)]
        line = getattr(error, "lineno", None) or (lines[-1] if lines else 1)
        raise InputError(f"{path}, line {line}: {type(error).__name__}: {error}") from None

    def held(name: str, *kinds: type) -> tuple[Any, ...]:
        found = getattr(module, name, ())
        wanted = " and ".join(kind.__name__ for kind in kinds)
        if not isinstance(found, list | tuple):
            raise InputError(f"{path}: {name} must be a list of {wanted}")
        for one in found:
            if not isinstance(one, kinds):
                raise InputError(f"{path}: {name} holds {one!r}; write objects of {wanted}")
        return tuple(found)

    laws = held("LAWS", ForceLaw, Operator)
    return OwnPhysics(
        laws=tuple(law for law in laws if isinstance(law, ForceLaw)),
        operators=tuple(law for law in laws if isinstance(law, Operator)),
        effects=held("EFFECTS", Effect),
    )
