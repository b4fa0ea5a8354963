"""Read a rig: a folder with ``params.toml`` and the MJCF it names. Disk only, no physics."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pamsim.core.errors import InputError, nearest
from pamsim.core.files import is_file
from pamsim.core.parameters import Sourced
from pamsim.physics.hysteresis.catalog import OPERATORS, Operator
from pamsim.recordings.effects_file import OwnPhysics, read_effects
from pamsim.recordings.toml_file import read_toml

SCHEMA = "pamsim-rig/1"

Section = Mapping[str, "Sourced | str"]
"""A TOML table: numbers with their source, and words such as the name of a law."""

_TOP = {"schema", "rig", "muscle", "muscles", "native", "sensor"}
_RIG = {"name", "purpose", "mjcf", "scene", "angle_joint", "joints", "load_body"}
_NUMBER = {"value", "unit", "source", "interval95", "bounds", "note"}


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
    path = Path(rig)
    if is_file(path / "params.toml"):
        return path
    names = shipped_rig_names()
    if str(rig) in names:
        return shipped_rigs() / str(rig)
    raise InputError(
        f"no rig {str(rig)!r}: it is neither a folder with params.toml nor a shipped rig;"
        f" {nearest(str(rig), names)}"
    )


def add_rigs_laws(rig: str | os.PathLike[str] | None) -> None:
    """Add the laws of a rig to the catalogs, for what needs the laws and not the rig.

    Args:
        rig: rig folder or name of a shipped rig; None for no rig.

    Raises:
        InputError: as `read_effects`, or if there is no such rig.
    """
    if rig is not None:
        read_effects(find_rig(rig))


def read_rig(rig: str | os.PathLike[str]) -> RigFile:
    """Read a rig's ``params.toml``, and run its ``effects.py`` if it has one.

    Args:
        rig: name of a shipped rig, or path of a rig folder.

    Raises:
        InputError: for a missing file, bad TOML, an unknown or missing key, each with its place.
    """
    folder = find_rig(rig)
    path = folder / "params.toml"
    table = read_toml(path)
    if table.get("schema") != SCHEMA:
        raise InputError(f"{path}: schema is {table.get('schema')!r}; this pamsim reads {SCHEMA!r}")
    _check_keys(path, "", table, _TOP)
    head = _table(path, table, "rig")
    _check_keys(path, "rig.", head, _RIG)
    mjcf = _file(path, folder, _word(path, head, "rig", "mjcf"))
    muscles = _table(path, table, "muscles")
    for name, entry in muscles.items():
        if not isinstance(entry, Mapping):
            raise InputError(f'{path}: muscles.{name} must be a table: {{ tendon = "..." }}')
        if "tendon" in entry and "joint" in entry:
            raise InputError(f"{path}: muscles.{name} names a tendon and a joint; keep one of them")
    places = {name: "joint" if "joint" in m else "tendon" for name, m in muscles.items()}
    overrides = {
        name: _sections(path, f"muscles.{name}", {k: v for k, v in m.items() if k != places[name]})
        for name, m in muscles.items()
    }
    return RigFile(
        folder=folder,
        name=_word(path, head, "rig", "name"),
        purpose=_word(path, {"purpose": "", **head}, "rig", "purpose"),
        mjcf=mjcf,
        scene=_file(path, folder, str(head["scene"])) if "scene" in head else None,
        joints=_joints(path, head),
        load_body=str(head["load_body"]) if "load_body" in head else None,
        tendons={
            name: _word(path, entry, f"muscles.{name}", places[name])
            for name, entry in muscles.items()
        },
        rods=tuple(str(m["joint"]) for name, m in muscles.items() if places[name] == "joint"),
        muscle=_sections(path, "muscle", _table(path, table, "muscle")),
        overrides=overrides,
        native=_numbers(path, "native", _table(path, {"native": {}, **table}, "native")),
        sensor=_numbers(path, "sensor", _table(path, {"sensor": {}, **table}, "sensor")),
        own=read_effects(folder),
    )


def _table(path: Path, table: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    found = table.get(key)
    if not isinstance(found, Mapping):
        raise InputError(f"{path}: table [{key}] is missing")
    return found


def _word(path: Path, table: Mapping[str, Any], section: str, key: str) -> str:
    found = table.get(key) if isinstance(table, Mapping) else None
    if not isinstance(found, str):
        raise InputError(f'{path}: [{section}] needs {key} = "..."')
    return found


def _joints(path: Path, head: Mapping[str, Any]) -> tuple[str, ...]:
    if "angle_joint" in head:
        if "joints" in head:
            raise InputError(f"{path}: [rig] has angle_joint and joints; keep one of them")
        return (_word(path, head, "rig", "angle_joint"),)
    names = head.get("joints", [])
    known = isinstance(names, list) and all(isinstance(name, str) for name in names)
    if not known or len(set(names)) < len(names) or ("joints" in head and not names):
        raise InputError(
            f'{path}: [rig] joints must name each recorded joint once: ["hip", "knee"]'
        )
    return tuple(names)


def _file(path: Path, folder: Path, name: str) -> Path:
    found = folder / name
    if not is_file(found):
        raise InputError(f"{path}: names {name!r}, which is not in {folder}")
    return found


def _sections(path: Path, where: str, table: Mapping[str, Any]) -> dict[str, Section]:
    sections: dict[str, Section] = {}
    for group, entries in table.items():
        if not isinstance(entries, Mapping):
            raise InputError(f"{path}: {where}.{group} must be a table of parameters")
        sections[group] = {
            key: entry if isinstance(entry, str) else _number(path, f"{where}.{group}.{key}", entry)
            for key, entry in entries.items()
        }
    return sections


def _numbers(path: Path, where: str, table: Mapping[str, Any]) -> dict[str, Sourced]:
    return {key: _number(path, f"{where}.{key}", entry) for key, entry in table.items()}


def _number(path: Path, key: str, entry: Any) -> Sourced:
    where = f"{path}: {key}"
    if not isinstance(entry, Mapping):
        raise InputError(f'{where} must be {{ value = ..., unit = "...", source = "..." }}')
    _check_keys(path, f"{key}.", entry, _NUMBER)
    value = entry.get("value")
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"{where}.value = {value!r} is not a number")
    for word in ("unit", "source"):
        if not (isinstance(entry.get(word), str) and entry[word].strip()):
            raise InputError(f'{where} needs {word} = "..."; every number says its {word}')
    return Sourced(
        value=float(value),
        unit=entry["unit"],
        source=entry["source"],
        where=where,
        interval95=_pair(where, entry.get("interval95")),
        bounds=_pair(where, entry.get("bounds")),
        note=str(entry.get("note", "")),
    )


def _pair(where: str, pair: Any) -> tuple[float, float] | None:
    if pair is None:
        return None
    numbers = isinstance(pair, list) and all(isinstance(end, int | float) for end in pair)
    if not (numbers and len(pair) == 2 and pair[0] <= pair[1]):
        raise InputError(f"{where}: a range is written [low, high], got {pair!r}")
    return float(pair[0]), float(pair[1])


def _check_keys(path: Path, where: str, table: Mapping[str, Any], known: set[str]) -> None:
    for key in table:
        if key not in known:
            raise InputError(f"{path}: unknown key {where}{key}; {nearest(key, known)}")
