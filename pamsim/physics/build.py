"""Build a muscle from sections of sourced numbers, as a rig file states them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pamsim.core.errors import InputError, nearest
from pamsim.core.parameters import ParameterGroup, Sourced, specs
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.force_law import ForceLaw
from pamsim.physics.hysteresis.bouc_wen import BoucWen
from pamsim.physics.hysteresis.catalog import OPERATORS, Operator
from pamsim.physics.muscle import MUSCLE_ONLY, PLAIN_GROUPS, PUSHING_ONLY, Muscle

Sections = Mapping[str, Mapping[str, Sourced | str]]


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
    laws: dict[str, dict[str, Any]] = {"force": {**FORCE_LAWS}, "hysteresis": {**OPERATORS}}
    for law in own:
        laws[law.group.group][law.name] = law
    kinds: dict[str, type[ParameterGroup]] = {group.group: group for group in PLAIN_GROUPS}
    groups: dict[str, ParameterGroup] = {}
    for name, stated in sections.items():
        section = dict(stated)
        if name in laws:
            chosen, known = section.pop("law", None), laws[name]
            if not isinstance(chosen, str) or chosen not in known:
                raise InputError(
                    f"{where}: {name}.law = {chosen!r} is not known; {nearest(str(chosen), known)}"
                )
            groups[name] = _build(known[chosen].group, section, where)
        elif name in kinds:
            groups[name] = _build(kinds[name], section, where)
        else:
            raise InputError(f"{where}: unknown group {name!r}; {nearest(name, {*kinds, *laws})}")
    pushing = "force" in groups and FORCE_LAWS.card(type(groups["force"])).pushes
    kind, body = ("pushing actuator", "stroke") if pushing else ("muscle", "braid")
    for name in ("mounting", body, "force", "chamber", "valve"):
        if name not in groups:
            raise InputError(f"{where}: a {kind} needs the group {name!r}")
    for name in sorted(_idle(pushing) & groups.keys()):
        raise InputError(f"{where}: the group {name!r} has no meaning for a {kind}; remove it")
    # Without width it changes no bit; with it, diagnoses can try hysteresis on any rig.
    groups.setdefault("hysteresis", BoucWen(**BoucWen.usual))
    return Muscle(command=command, **groups)  # pyright: ignore[reportArgumentType]


def _build(group: type[ParameterGroup], section: Mapping[str, Any], where: str) -> ParameterGroup:
    fields = dict(specs(group))
    values: dict[str, float] = {}
    for name, entry in section.items():
        if name not in fields:
            raise InputError(
                f"{where}: unknown parameter {group.group}.{name}; {nearest(name, fields)}"
            )
        if not isinstance(entry, Sourced):
            raise InputError(
                f"{where}: {group.group}.{name} = {entry!r} is a word; write"
                ' { value = ..., unit = "...", source = "..." }'
            )
        values[name] = entry.si(fields[name].unit)
    missing = [name for name in fields if name not in values and not hasattr(group, name)]
    if missing:
        raise InputError(
            f"{where}: {group.group} needs {', '.join(missing)} ({fields[missing[0]].doc})"
        )
    return group(**values)


def idle_groups(sections: Sections) -> frozenset[str]:
    """Names of the groups that have no meaning for an actuator with these sections."""
    law = sections.get("force", {}).get("law")
    return _idle(isinstance(law, str) and law in FORCE_LAWS and FORCE_LAWS[law].pushes)


def _idle(pushing: bool) -> frozenset[str]:
    return frozenset(group.group for group in (MUSCLE_ONLY if pushing else PUSHING_ONLY))
