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
    diagnose_rows,
    diagnose_signals,
    diagnose_where,
)
from pamsim.report.page import write_page

SCHEMA = "pamsim-diagnosis/2"


def write_diagnosis(
    result: Mapping[str, Any], comparisons: Sequence[Comparison], out: Path
) -> list[Path]:
    """Write page and figures of a diagnosis of recordings, a table at rest or a loop.

    Args:
        result: of schema ``pamsim-diagnosis/2``.
        comparisons: every compared channel of every trial; empty for a table or a loop.
        out: folder to write into; made if missing, files of the same names are replaced.

    Returns:
        The files written, the page first.

    Raises:
        InputError: if the result has another schema, or the place cannot be written.
    """
    noise = _noise(result)
    shown = diagnose_signals.worst_trials(comparisons, noise)
    return write_page(
        out,
        "diagnose.html",
        result,
        lambda: dict(_figures(result, comparisons, shown, noise)),
        schema=SCHEMA,
        shown=shown,
        held_out=_grouped(result["held_out"]),
        repaired=any(entry["after"] is not None for entry in result["gap"].values()),
    )


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
        yield "gap", diagnose_gap.gap_bars(result["gap"])
    if result["rows"]:
        yield "rows", diagnose_rows.row_errors(result)
    if result["branches"]:
        yield "branches", diagnose_rows.loop_branches(result)
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
