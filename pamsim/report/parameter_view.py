"""A rig's parameters as a page shows them: each number with its interval and where it is from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pamsim.report.numbers import interval, plain, unit

_SOURCES = ("identified", "assumed", "datasheet", "paper")
_CITING = ("matiskova", "nguyen", "van damme", "sarosi", "alraouf", "paper", "published", "table")


@dataclass(frozen=True)
class ParameterView:
    """One line of the table of parameters; ``tag`` is the kind of source."""

    name: str
    value: str
    interval: str
    unit: str
    tag: str
    source: str
    note: str


def parameter_views(result: Mapping[str, Any]) -> list[ParameterView]:
    """Prepare the table of parameters.

    Args:
        result: of schema ``pamsim-reproduce/1``.

    Returns:
        One line per parameter, in the order given.
    """
    views: list[ParameterView] = []
    for item in result.get("parameters") or ():
        source = str(item.get("source") or "")
        tag = source_tag(source)
        views.append(
            ParameterView(
                name=str(item.get("name") or ""),
                value=plain(item.get("value")),
                interval=interval(item.get("interval95"), 3),
                unit=unit(item.get("unit")),
                tag=tag,
                source="" if source.lower() == tag else source,
                note=str(item.get("note") or ""),
            )
        )
    return views


def source_tag(source: str) -> str:
    """Name the kind of a parameter's source.

    Args:
        source: as a rig file writes it, such as ``Matiskova 2021, Table 1`` or ``identified``.

    Returns:
        ``identified``, ``assumed``, ``datasheet``, ``paper``, or ``other``.
    """
    text = source.lower()
    for tag in _SOURCES:
        if text.startswith(tag):
            return tag
    if "datasheet" in text:
        return "datasheet"
    return "paper" if any(word in text for word in _CITING) else "other"
