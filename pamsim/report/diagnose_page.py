"""The page of a diagnosis of a table at rest or a loop: the verdict and what it rests on."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from pamsim.report import diagnose_rows, diagnose_where
from pamsim.report.numbers import fixed, words
from pamsim.report.page import write_page

SCHEMA = "pamsim-diagnosis/2"

_MANY = 4  # models, from which on a headline counts them


def write_diagnosis(result: Mapping[str, Any], out: Path) -> list[Path]:
    """Write page and figures of a diagnosis of a table at rest or a loop.

    Args:
        result: of schema ``pamsim-diagnosis/2``.
        out: folder to write into; made if missing, files of the same names are replaced.

    Returns:
        The files written, the page first.

    Raises:
        InputError: if the result has another schema, or the place cannot be written.
    """
    return write_page(
        out,
        "diagnose.html",
        result,
        lambda: dict(_figures(result)),
        schema=SCHEMA,
        held_out=_grouped(result["held_out"]),
        repaired=any(entry["after"] is not None for entry in result["gap"].values()),
        headline=headline(result),
        level=error_level(result),
        limits={k: v for k, v in result["absent"].items() if "cannot_tell" not in v},
        unseen={k: v for k, v in result["absent"].items() if "cannot_tell" in v},
    )


def headline(result: Mapping[str, Any]) -> str:
    """What was found, in a few words.

    Args:
        result: of schema ``pamsim-diagnosis/2``.
    """
    found = " + ".join(words(effect["name"]) for effect in result["effects"])
    match result["verdict"]:
        case "no_gap":
            return "No gap: nothing is missing that these data can show"
        case "named":
            return f"Missing: {found}"
        case "named_with_remainder":
            return f"Missing: {found}, or something that resembles it"
        case "ambiguous":
            families = " and ".join(map(words, result["certain_families"]))
            names = [words(model["name"]).replace("+", " + ") for model in result["alternatives"]]
            if families:
                return f"Missing: {families}, of a kind that is open"
            few = len(names) < _MANY
            return f"Missing: {' or '.join(names) if few else f'one of {len(names)} models'}"
        case "unexplained":
            return "Something is missing that no known effect explains"
        case _:
            return "Too little data to judge whether something is missing"


def error_level(result: Mapping[str, Any]) -> str:
    """The held-out error of all channels, before and, where something repairs it, after.

    Args:
        result: of schema ``pamsim-diagnosis/2``.
    """
    levels = [(e["before"], e["after"], e["unit"]) for e in result["gap"].values()]
    shown = [
        " → ".join(fixed(level["value"], 2) for level in (before, after) if level) + f" {of}"
        for before, after, of in levels
    ]
    return ", ".join(shown)


def first_figure(result: Mapping[str, Any]) -> Figure:
    """The figure that the page shows first: a table's rows, or a loop.

    Args:
        result: of schema ``pamsim-diagnosis/2``.
    """
    _, figure = next(_figures(result))
    return figure


def _figures(result: Mapping[str, Any]) -> Iterator[tuple[str, Figure]]:
    """Name and figure, for all of which the data have what they show, in the page's order."""
    if result["rows"]:
        yield "rows", diagnose_rows.row_errors(result)
    if result["branches"]:
        yield "branches", diagnose_rows.loop_branches(result)
    maps = diagnose_where.significant_maps(result["maps"])
    if maps:
        yield "maps", diagnose_where.binned_maps(maps)


def _grouped(names: Sequence[str]) -> str:
    """Names of trials or rows, those that differ in their last number together."""
    stems = Counter(re.sub(r"[_ ]?\d+( kPa)?$", "", name) or name for name in names)
    return ", ".join(f"{stem} ({count})" for stem, count in stems.items())
