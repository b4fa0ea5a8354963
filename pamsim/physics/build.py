"""Build a muscle from sections of sourced numbers, as a rig file states them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pamsim.core.catalog import Catalog
from pamsim.core.errors import InputError, nearest
from pamsim.core.parameters import ParameterGroup, Sourced, specs
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.force_law import ForceLaw
from pamsim.physics.hysteresis.bouc_wen import BoucWen
from pamsim.physics.hysteresis.catalog import OPERATORS, Operator
from pamsim.physics.muscle import (
    MUSCLE_ONLY,
    PLAIN_GROUPS,
    PUSHING_ONLY,
    Muscle,
)

Sections = Mapping[str, Mapping[str, Sourced | str]]

_LAWS: Mapping[str, Catalog[Any]] = {"force": FORCE_LAWS, "hysteresis": OPERATORS}


def build_muscle(
    sections: Sections,
    *,
    where: str,
    command: str = "pressure_set",
    own: Sequence[ForceLaw | Operator] = (),
) -> Muscle:
    """Make a muscle from its sections.

    Args:
        sections: group -> field -> number. ``force`` and ``hysteresis`` also carry ``law``; a
            muscle that states no hysteresis gets Bouc-Wen's without width.
        where: what to call the place in errors.
        command: what the muscle's control means, one of `COMMANDS`.
        own: laws of the rig, which count before those of the catalogs.

    Raises:
        InputError: for an unknown group, law or field, a missing field, or a wrong unit.
        ParameterError: for a value out of range.
    """
    known = {group.group for group in PLAIN_GROUPS} | set(_LAWS)
    for name in sections:
        if name not in known:
            raise InputError(f"{where}: unknown group {name!r}; {nearest(name, known)}")
    groups: dict[str, Any] = {}
    for group in PLAIN_GROUPS:
        if group.group in sections:
            groups[group.group] = _build(group, sections[group.group], where)
    for name, catalog in _LAWS.items():
        laws = {**catalog, **{law.name: law for law in own if law.group.group == name}}
        if name in sections:
            section = dict(sections[name])
            law = section.pop("law", None)
            if not isinstance(law, str) or law not in laws:
                raise InputError(
                    f"{where}: {name}.law = {law!r} is not known; {nearest(str(law), laws)}"
                )
            groups[name] = _build(laws[law].group, section, where)
    pushing = "force" in groups and FORCE_LAWS.card(groups["force"].__class__).pushes
    needed, idle = ("stroke", MUSCLE_ONLY) if pushing else ("braid", PUSHING_ONLY)
    kind = "pushing actuator" if pushing else "muscle"
    for name in ("mounting", needed, "force", "chamber", "valve"):
        if name not in groups:
            raise InputError(f"{where}: a {kind} needs the group {name!r}")
    for group in idle:
        if group.group in groups:
            raise InputError(
                f"{where}: the group {group.group!r} has no meaning for a {kind}; remove it"
            )
    # Without width it changes no bit; with it, diagnoses can try hysteresis on any rig.
    groups.setdefault("hysteresis", BoucWen(**BoucWen.usual))
    return Muscle(command=command, **groups)


def _build(group: type[ParameterGroup], section: Mapping[str, Any], where: str) -> ParameterGroup:
    fields = dict(specs(group))
    for key in section:
        if key not in fields:
            raise InputError(
                f"{where}: unknown parameter {group.group}.{key}; {nearest(key, fields)}"
            )
    values: dict[str, float] = {}
    for name, spec in fields.items():
        entry = section.get(name)
        if isinstance(entry, Sourced):
            values[name] = entry.si(spec.unit)
        elif entry is not None:
            raise InputError(
                f"{where}: {group.group}.{name} = {entry!r} is a word; write"
                ' { value = ..., unit = "...", source = "..." }'
            )
    try:
        return group(**values)
    except TypeError:
        missing = [n for n in fields if n not in values and not _has_default(group, n)]
        raise InputError(
            f"{where}: {group.group} needs {', '.join(missing)} ({fields[missing[0]].doc})"
        ) from None


def _has_default(group: type[ParameterGroup], name: str) -> bool:
    return hasattr(group, name)


def idle_groups(sections: Sections) -> frozenset[str]:
    """Names of the groups that have no meaning for an actuator with these sections."""
    return frozenset(g.group for g in (MUSCLE_ONLY if _pushes(sections) else PUSHING_ONLY))


def _pushes(sections: Sections) -> bool:
    """Whether the force law of an actuator with these sections may push."""
    law = sections.get("force", {}).get("law")
    return isinstance(law, str) and law in FORCE_LAWS and FORCE_LAWS[law].pushes
