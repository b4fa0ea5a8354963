"""Write a rig with changed parameters: a copy of its folder, its ``params.toml`` revised in place.

Comments, order and units of the original stay; each changed number states its new source.
"""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.items import InlineTable

from pamsim.core.errors import InputError, refuse_unknown
from pamsim.core.files import LOCK, complete_file, is_part
from pamsim.core.parameters import Sourced, specs
from pamsim.core.units import to_si
from pamsim.physics.hysteresis.bouc_wen import BoucWen
from pamsim.physics.hysteresis.group import Hysteresis
from pamsim.recordings.rig_file import RigFile
from pamsim.recordings.sensors import MeasurementChain

_DIGITS = 10
_RANGE_DIGITS = 5
_REFERENCE = re.compile(r"""\bfile\s*=\s*["']([^"']*)""")  # to a mesh, a texture, another MJCF
# Files that describe the old parameters.
_LEFT_BEHIND = {"params.toml", "README.md", "calibration.json", "__pycache__", LOCK}


def write_rig(
    source: RigFile, folder: Path, values: Mapping[str, Sourced], *, heading: str = ""
) -> Path:
    """Write a rig in which some parameters have new values.

    An MJCF outside the rig's folder is copied along; if it refers to other files, such as meshes,
    the new rig names it where it is.

    Args:
        source: the rig to start from.
        folder: of the new rig, created if need be; files of the same name are replaced.
        values: name -> number, in any unit that measures the parameter; it is converted to the unit
            in the file, and keeps its own if the parameter is new there. Names are those of
            `pamsim.engine.rig.Rig.with_parameters`; ``group.field`` replaces what single muscles
            had of their own. The old value's 95 % interval and note are removed; bounds stay unless
            new ones are given.
        heading: comment for the top of the file.

    Returns:
        Path of the new ``params.toml``.

    Raises:
        InputError: for an unknown muscle, a unit that does not fit, a folder that is the source's
            own or lies inside it, or a place that cannot be written.
    """
    old, new = source.folder.resolve(), folder.resolve()
    if new.is_relative_to(old):
        raise InputError(
            f"cannot write a rig to {folder}: it is the folder it is made from, or inside it"
        )
    document = tomlkit.parse((source.folder / "params.toml").read_text(encoding="utf-8"))
    # Shared numbers first: they clear what single muscles had, which may follow again.
    for name in sorted(values, key=lambda name: ":" in name):
        _put(document, source, name, values[name])
    # Rigs may share an MJCF outside their folders.
    named = {key: document["rig"][key] for key in ("mjcf", "scene") if key in document["rig"]}
    files = {key: (source.folder / name).resolve() for key, name in named.items()}
    outside = {key: file for key, file in files.items() if not file.is_relative_to(old)}
    copied = set(outside.values())
    if any(references(file) - copied for file in copied):
        copied = set[Path]()
    for key, file in outside.items():
        place = file.name if file in copied else os.path.relpath(file, new)
        document["rig"][key] = Path(place).as_posix()
    text = "".join(f"# {line}\n" for line in heading.splitlines()) + tomlkit.dumps(document)
    try:
        shutil.copytree(
            source.folder, folder, dirs_exist_ok=True, ignore=_left_behind, copy_function=_copy
        )
        for file in copied:
            _copy(str(file), str(folder / file.name))
    except (OSError, shutil.Error) as error:
        raise InputError(f"cannot write {folder}: {error}") from None
    path = folder / "params.toml"
    with complete_file(path) as part:
        part.write_text(text, encoding="utf-8")
    return path


def references(mjcf: Path) -> set[Path]:
    """The files that an MJCF names, but for where it states that meshes and textures are."""
    text = mjcf.read_text(encoding="utf-8", errors="replace")
    return {mjcf.parent / name for name in _REFERENCE.findall(text)}


def _left_behind(folder: str, names: list[str]) -> set[str]:
    """What is not copied: files about the old parameters, and folders of other rigs."""
    rigs = {name for name in names if (Path(folder) / name / "params.toml").is_file()}
    return rigs | (_LEFT_BEHIND & set(names)) | set(filter(is_part, names))


def _copy(source: str, target: str) -> None:
    with complete_file(Path(target)) as part:
        shutil.copyfile(source, part)


def _put(document: Any, source: RigFile, name: str, number: Sourced) -> None:
    owner, _, parameter = name.rpartition(":")
    group, _, field = parameter.partition(".")
    muscles = document["muscles"]
    if group == Hysteresis.group:
        law, _, field = field.rpartition(".")
        if not any("law" in one.get(group, {}) for one in (document["muscle"], *muscles.values())):
            law = law or BoucWen.law  # that of muscles which state none
        if law:
            _operator(document["muscle"], muscles, source.operators[law].group)
    if owner:
        refuse_unknown(owner, source.tendons, f"no muscle {owner!r}")
        section = _table(muscles[owner], group)
    elif name in source.native or "." in field:
        section, field = _table(document, "native"), name
    elif group == MeasurementChain.group:
        section = _table(document, group)
    else:
        section = _table(_table(document, "muscle"), group)
        for own in muscles.values():
            own.get(group, {}).pop(field, None)
    _revise(section, field, number)


def _operator(muscle: Any, own: Any, group: type[Hysteresis]) -> None:
    """Give all muscles a hysteresis operator; of another's tables stays what all operators share.

    So stay the widths that single muscles have, as in `pamsim.engine.rig.Rig.with_operator`.
    """
    law, section = group.law, _table(muscle, Hysteresis.group)
    before = section.get("law")
    each = [entries[Hysteresis.group] for entries in own.values() if Hysteresis.group in entries]
    for table in (section, *each):
        if table.get("law", before) != law:
            for key in table.keys() - dict(specs(Hysteresis)):
                table.remove(key)
    if before == law:
        return
    section["law"] = law
    units = {name: spec.unit for name, spec in specs(group)}
    for name, value in group.usual.items():
        _revise(section, name, Sourced(value=value, unit=units[name], source="assumed", where=law))


def _table(parent: Any, key: str) -> Any:
    if key not in parent:
        inline = isinstance(parent, InlineTable)
        parent[key] = tomlkit.inline_table() if inline else tomlkit.table()
    return parent[key]


def _revise(section: Any, key: str, number: Sourced) -> None:
    """Change an entry, keeping the comment behind it, or add it."""
    before = section[key].unwrap() if key in section else {"unit": number.unit}

    def written(value: float, digits: int) -> float:
        return float(f"{to_si(value, number.unit, before['unit'], where=key):.{digits}g}")

    def pair(ends: tuple[float, float] | None) -> list[float] | None:
        return [written(end, _RANGE_DIGITS) for end in ends] if ends else None

    fields = {
        "value": written(number.value, _DIGITS),
        "unit": before["unit"],
        "source": number.source,
        "interval95": pair(number.interval95),
        "bounds": pair(number.bounds) or before.get("bounds"),
        "note": number.note or None,
    }
    # Parsed, for the spaces that people write.
    stated = [f"{k} = {tomlkit.item(v).as_string()}" for k, v in fields.items() if v is not None]
    section[key] = tomlkit.value(f"{{ {', '.join(stated)} }}")
