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
from pamsim.core.files import read_bounded
from pamsim.core.limits import CODE_BYTES
from pamsim.core.parameters import Sourced
from pamsim.core.toml_tables import NUMBER, Entry, check_table, read_toml
from pamsim.effects.effect import Effect
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.force_law import ForceLaw
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.hysteresis.group import Operator

SCHEMA = "pamsim-rig/1"
EFFECTS = "effects.py"

Section = Mapping[str, "Sourced | str"]
"""A TOML table: numbers with their source, and words such as the name of a law."""


def _is_range(ends: list[Any]) -> bool:
    numbers = all(isinstance(end, NUMBER) for end in ends)
    return numbers and len(ends) == 2 and ends[0] <= ends[1]


def _are_names(names: list[Any]) -> bool:
    return 0 < len(names) == len({name for name in names if isinstance(name, str)})


_TOP = {
    "schema": Entry(),
    **{key: Entry(Mapping, f"..., as a table [{key}]") for key in ("rig", "muscle", "muscles")},
    **{key: Entry(Mapping, f"a table [{key}]", {}) for key in ("native", "sensor")},
}
_RIG = {
    **dict.fromkeys(("name", "mjcf"), Entry()),
    "purpose": Entry(default=""),
    **dict.fromkeys(("scene", "angle_joint", "load_body"), Entry(default=None)),
    "joints": Entry(list, '["hip", "knee"], each recorded joint once', None, _are_names),
}
_RANGE = Entry(list, "[low, high]", None, _is_range)
_NUMBER = {
    "value": Entry(NUMBER, "12.5"),
    "unit": Entry(),
    "source": Entry(),
    "interval95": _RANGE,
    "bounds": _RANGE,
    "note": Entry(default=""),
}


@dataclass(frozen=True, kw_only=True)
class OwnPhysics:
    """Force laws, operators of hysteresis and effects that a rig adds to the package."""

    laws: tuple[ForceLaw, ...] = ()
    operators: tuple[Operator, ...] = ()
    effects: tuple[Effect, ...] = ()


@dataclass(frozen=True, kw_only=True)
class RigFile:
    """A rig as its folder states it."""

    folder: Path  # where it lies
    name: str  # of the rig
    purpose: str = ""  # what it is and is for, in a sentence; empty if not stated
    mjcf: Path  # path of the device's MJCF
    scene: Path | None  # path of the MJCF with floor and light, or None
    # Whose positions are recorded; none stands for those that the muscles move
    joints: tuple[str, ...]
    load_body: str | None  # body that carries the load, or None
    # muscle -> tendon, or the joint that it slides along, in actuator order
    tendons: Mapping[str, str]
    rods: tuple[str, ...]  # joints that carry a muscle and get a tendon of their name
    muscle: Mapping[str, Section]  # shared sections, group -> entries
    # muscle name -> group -> entries that replace shared ones
    overrides: Mapping[str, Mapping[str, Section]]
    native: Mapping[str, Sourced]  # MJCF field, such as ``joint.shaft.damping`` -> value
    sensor: Mapping[str, Sourced]  # measurement chain -> value
    # What its ``effects.py`` adds to the package
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
    """Folder of a shipped rig, by its name, or of a path.

    Raises:
        InputError: for no such rig, with the nearest name; for a name that a shipped rig and a
            folder share, which would otherwise run the folder's code wherever a name is usual.
    """
    name, names, folder = str(rig), shipped_rig_names(), Path(rig)
    shipped = shipped_rigs() / name if name in names else None
    if os.path.isfile(folder / "params.toml"):
        if shipped is not None and isinstance(rig, str) and not folder.samefile(shipped):
            raise InputError(
                f"{name!r} is a shipped rig and a folder here: write './{name}' for the folder;"
                " for the shipped rig, rename the folder"
            )
        return folder.absolute() if str(folder) in names else folder
    if shipped is not None:
        return shipped
    if folder.suffix == ".xml":
        raise InputError(
            f"{name}: an MJCF alone is no rig; `pamsim new-rig NAME --mjcf {name}` makes one of it"
        )
    raise InputError(
        f"no rig {name!r}: it is neither a folder with params.toml nor a shipped rig;"
        f" {nearest(name, names)}"
    )


def read_rig(rig: str | os.PathLike[str]) -> RigFile:
    """Read the ``params.toml`` of a shipped rig or a folder, and run its ``effects.py``, if any.

    Raises:
        InputError: for a missing file, bad TOML, an unknown or missing key, each with its place.
    """
    folder = find_rig(rig)
    path = folder / "params.toml"
    document = check_table(read_toml(path, SCHEMA), _TOP, path)
    head = check_table(document["rig"], _RIG, f"{path}: [rig]")
    if head["angle_joint"] and head["joints"]:
        raise InputError(f"{path}: [rig] has angle_joint and joints; keep one of them")
    for name in filter(None, (head["mjcf"], head["scene"])):
        if not os.path.isfile(folder / name):
            raise InputError(f"{path}: names {name!r}, which is not in {folder}")
    tendons: dict[str, str] = {}
    rods: list[str] = []
    overrides: dict[str, Mapping[str, Section]] = {}
    for name, muscle in document["muscles"].items():
        where = f"{path}: muscles.{name}"
        if not isinstance(muscle, Mapping):
            raise InputError(f'{where} must be a table: {{ tendon = "..." }}')
        if "tendon" in muscle and "joint" in muscle:
            raise InputError(f"{where} names a tendon and a joint; keep one of them")
        on = "joint" if "joint" in muscle else "tendon"
        place = {key: muscle[key] for key in muscle if key == on}
        tendons[name] = check_table(place, {on: Entry()}, where)[on]
        rods += [tendons[name]] if on == "joint" else []
        twin = next(other for other, at in tendons.items() if at == tendons[name])
        if on == "tendon" and twin != name:
            raise InputError(
                f"{where}: tendon {tendons[name]!r} has {twin!r} already; give each muscle its own"
            )
        own = (group for group in muscle if group != on)
        overrides[name] = {group: _section(muscle[group], f"{where}.{group}") for group in own}
    return RigFile(
        folder=folder,
        name=head["name"],
        purpose=head["purpose"],
        mjcf=folder / head["mjcf"],
        scene=folder / head["scene"] if head["scene"] else None,
        joints=(head["angle_joint"],) if head["angle_joint"] else tuple(head["joints"] or ()),
        load_body=head["load_body"],
        tendons=tendons,
        rods=tuple(rods),
        muscle={g: _section(t, f"{path}: muscle.{g}") for g, t in document["muscle"].items()},
        overrides=overrides,
        **{
            key: {
                name: _number(one, f"{path}: {key}.{name}") for name, one in document[key].items()
            }
            for key in ("native", "sensor")
        },
        own=read_effects(folder),
    )


def _section(table: object, where: str) -> Section:
    """The numbers and words of a table."""
    if not isinstance(table, Mapping):
        raise InputError(f"{where} must be a table of parameters")
    return {
        key: one if isinstance(one, str) else _number(one, f"{where}.{key}")
        for key, one in table.items()
    }


def _number(table: object, where: str) -> Sourced:
    stated = check_table(table, _NUMBER, where)
    for key in ("interval95", "bounds"):
        stated[key] = tuple(map(float, stated[key])) if stated[key] else None
    return Sourced(**{**stated, "value": float(stated["value"])}, where=where)


def add_rigs_laws(rig: str | os.PathLike[str] | None) -> None:
    """Add the laws of a rig, if one is given, to the catalogs; raises as `read_rig`."""
    if rig is not None:
        read_effects(find_rig(rig))


def refuse_code(rig: str | os.PathLike[str], remedy: str = "") -> None:
    """Refuse a rig that only a file names if it has code of its own, which would run unasked.

    The remedy is how the user asks for it; by naming the rig if left out.
    """
    path = find_rig(rig) / EFFECTS
    if path.is_file():
        remedy = remedy or f"you name its rig: give `rig` {path.parent}"
        raise InputError(f"{path} is code, which runs only if {remedy}")


def read_effects(folder: Path) -> OwnPhysics:
    """Run the ``effects.py`` in a rig's folder, if there is one, and add its laws to the catalogs.

    Raises:
        InputError: if the file fails, or holds something else than laws and effects.
    """
    path = folder / EFFECTS
    if not path.is_file():
        return OwnPhysics()
    try:
        text = read_bounded(path, CODE_BYTES).decode("utf-8-sig")
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not UTF-8 text: {error}") from None
    files = [(file.name, file.stat()) for file in folder.iterdir() if file.is_file()]
    beside = tuple(sorted((name, own.st_mtime_ns, own.st_size) for name, own in files))
    own = _own_physics(path.resolve(), text, beside)
    # Every time: the newest of a name is what the catalogs list, also of two rigs in turn.
    for law in own.laws:
        FORCE_LAWS.add(law, str(path))
    for operator in own.operators:
        OPERATORS.add(operator, str(path))
    return own


@functools.cache
def _own_physics(path: Path, text: str, _beside: tuple[tuple[str, int, int], ...]) -> OwnPhysics:
    # It runs again when a file beside it changes, from which it may read, such as weights.
    # A module, so that its classes know where they come from; no cached bytecode beside the rig.
    module = types.ModuleType(f"pamsim_rig_{zlib.crc32(str(path).encode()):08x}")
    module.__file__ = str(path)
    sys.modules[module.__name__] = module
    try:
        exec(compile(text, str(path), "exec"), module.__dict__)
    except PamsimError as error:
        raise InputError(f"{path}: {error}") from None
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # whatever the rig's own code raises, an exit among it
        frames = traceback.extract_tb(error.__traceback__)
        lines = [frame.lineno for frame in frames if frame.filename == str(path)]
        line = getattr(error, "lineno", None) or (lines[-1] if lines else 1)
        reason = str(traceback.TracebackException(type(error), error, None))  # its own may fail
        raise InputError(f"{path}, line {line}: {type(error).__name__}: {reason}") from None
    kinds = {"LAWS": ForceLaw | Operator, "EFFECTS": Effect}
    if not any(hasattr(module, name) for name in kinds):
        raise InputError(f"{path} has neither a list LAWS nor a list EFFECTS")
    held = {name: getattr(module, name, ()) for name in kinds}
    for name, kind in kinds.items():
        wanted = " and ".join(one.__name__ for one in getattr(kind, "__args__", (kind,)))
        if not isinstance(held[name], list | tuple):
            raise InputError(f"{path}: {name} must be a list of {wanted}")
        for one in held[name]:
            if not isinstance(one, kind):
                raise InputError(f"{path}: {name} holds {one!r}; write objects of {wanted}")
    return OwnPhysics(
        laws=tuple(law for law in held["LAWS"] if isinstance(law, ForceLaw)),
        operators=tuple(law for law in held["LAWS"] if isinstance(law, Operator)),
        effects=tuple(held["EFFECTS"]),
    )
