"""The page of a diagnosis: the verdict, what it rests on, where the gap is, what was tried."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from pamsim.comparison.compared_signal import Comparison
from pamsim.report import (
    diagnose_gap,
    diagnose_loops,
    diagnose_signals,
    diagnose_where,
)
from pamsim.report.numbers import fixed, significant, words
from pamsim.report.page import inline_image, write_page

SCHEMA = "pamsim-diagnosis/2"

_MANY = 4  # models, from which on a headline counts them


def write_diagnosis(
    result: Mapping[str, Any],
    comparisons: Sequence[Comparison],
    out: Path,
    *,
    film: Path | None = None,
) -> list[Path]:
    """Write page and figures of a diagnosis of recordings, a table at rest or a loop.

    Args:
        result: of schema ``pamsim-diagnosis/2``.
        comparisons: every compared channel of every trial; empty for a table or a loop.
        out: folder to write into; made if missing, files of the same names are replaced.
        film: a GIF of the first trial shown, see `pamsim.report.gap_film`, or None.

    Returns:
        The files written, the page first.

    Raises:
        InputError: if the result has another schema, or the place cannot be written.
    """
    noise = _noise(result)
    shown = shown_trials(result, comparisons)
    return write_page(
        out,
        "diagnose.html",
        result,
        lambda: dict(_figures(result, comparisons, shown, noise)),
        schema=SCHEMA,
        shown=shown,
        film=None if film is None else inline_image(film.read_bytes(), "gif"),
        held_out=_grouped(result["held_out"]),
        repaired=any(entry["after"] is not None for entry in result["gap"].values()),
        headline=headline(result),
        level=error_level(result),
        level_is="times the noise floor" if _over_floor(result) else "RMS",
        limits={k: v for k, v in result["absent"].items() if "cannot_tell" not in v},
        unseen={k: v for k, v in result["absent"].items() if "cannot_tell" in v},
    )


def shown_trials(result: Mapping[str, Any], comparisons: Sequence[Comparison]) -> list[str]:
    """Trials of recordings that the page shows, the one with the largest gap first.

    Args:
        result: of schema ``pamsim-diagnosis/2``.
        comparisons: every compared channel of every trial.
    """
    return diagnose_signals.worst_trials(comparisons, _noise(result))


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
    over = _over_floor(result)
    if over:
        return " → ".join(significant(level, 3) for level in over)
    levels = [(e["before"], e["after"], e["unit"]) for e in result["gap"].values()]
    shown = [
        " → ".join(fixed(level["value"], 2) for level in (before, after) if level) + f" {of}"
        for before, after, of in levels
    ]
    return ", ".join(shown)


def _over_floor(result: Mapping[str, Any]) -> list[float]:
    """Held-out error over the noise floor, before and after; empty where there is no floor."""
    return [level for level in result["gap_over_floor"].values() if level is not None]


def first_figure(result: Mapping[str, Any]) -> Figure:
    """The figure that the page shows first: the gap per channel, or a table's rows, or a loop.

    Args:
        result: of schema ``pamsim-diagnosis/2``.
    """
    _, figure = next(_figures(result, (), (), _noise(result)))
    return figure


def _noise(result: Mapping[str, Any]) -> dict[str, float]:
    """Channel -> noise floor [SI]; empty without repeats."""
    floor = result.get("noise_floor") or {"channels": {}}
    return {channel: entry["sd_si"] for channel, entry in floor["channels"].items()}


def _figures(
    result: Mapping[str, Any],
    comparisons: Sequence[Comparison],
    shown: Sequence[str],
    noise: Mapping[str, float],
) -> Iterator[tuple[str, Figure]]:
    """Name and figure, for all of which the data have what they show, in the page's order."""
    if noise and result["gap"]:
        yield "gap", diagnose_gap.gap_bars(result)
    if noise and result["where"]:
        given = result["where_with_measured_pressures"]
        yield "where", diagnose_where.where_map(result["where"], given)
    maps = diagnose_where.significant_maps(result["maps"])
    if maps:
        yield "maps", diagnose_where.binned_maps(maps)
    for number, trial in enumerate(shown, 1):
        parts = [part for part in comparisons if part.trial == trial]
        yield f"trial_{number}", diagnose_signals.trial_channels(parts, noise)
    if result["loop_areas"]:
        yield "loops", diagnose_loops.loop_areas(result["loop_areas"])
    if result["spectrum"]:
        yield "lines", diagnose_loops.residual_lines(result["spectrum"])
    if result["nuisance_by_protocol"]:
        yield "regimes", diagnose_gap.nuisance_by_protocol(result["nuisance_by_protocol"])


def _grouped(names: Sequence[str]) -> str:
    """Names of trials or rows, those that differ in their last number together."""
    stems = Counter(re.sub(r"[_ ]?\d+( kPa)?$", "", name) or name for name in names)
    return ", ".join(f"{stem} ({count})" for stem, count in stems.items())
