"""The page of a diagnosis by link: where the gap is, what is missing, what could be instead."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from pamsim.comparison.compared_signal import Comparison, shown_unit
from pamsim.report.link_figure import learned_curves, link_bars
from pamsim.report.page import inline_image, write_page
from pamsim.report.row_errors import loop_branches, row_errors
from pamsim.report.trial_signals import trial_channels, worst_trials

SCHEMA = "pamsim-diagnosis/3"


def write_link_diagnosis(
    result: Mapping[str, Any],
    comparisons: Sequence[Comparison],
    out: Path,
    *,
    film: Path | None = None,
    lead: str = "",
) -> list[Path]:
    """Write page and figures of a diagnosis by link as `write_page` does.

    Args:
        result: of schema ``pamsim-diagnosis/3``.
        comparisons: every compared channel of every trial, the whole chain simulated.
        out: folder.
        film: a GIF of the first trial shown, see `pamsim.report.gap_film`, or None.
        lead: a paragraph before all others, such as what was hidden in synthetic recordings.
    """
    shown = shown_trials(result, comparisons)
    return write_page(
        out,
        "link_diagnosis.html",
        result,
        lambda: dict(_figures(result, comparisons, shown)),
        schema=SCHEMA,
        headline=headline(result),
        shown=shown,
        lead=lead,
        film=None if film is None else inline_image(film.read_bytes(), "gif"),
        grouped=_grouped,
    )


def shown_trials(result: Mapping[str, Any], comparisons: Sequence[Comparison]) -> list[str]:
    """Held-out trials that the page shows, the one with the largest gap first."""
    return worst_trials(comparisons, _noise(result))


def headline(result: Mapping[str, Any]) -> str:
    """What was found, in a few words."""
    if result["effects"]:
        return f"Missing: {' and '.join(one['certain_words'] for one in result['effects'])}"
    if result["remainder"]:
        shape = ", but its shape is learned" if result["learned"] else ""
        return f"No effect tried explains the gap in {' and '.join(result['remainder'])}{shape}"
    return "No gap: nothing is missing that these data can show"


def first_figure(result: Mapping[str, Any]) -> tuple[str, Figure]:
    """Name and figure of where the gap is: of links, of a table's rows, or of a loop."""
    if result["rows"]:
        return "rows", row_errors(result)
    if result["branches"]:
        return "branches", loop_branches(result)
    return "links", link_bars(result["links"], repaired=bool(result["effects"]))


def _noise(result: Mapping[str, Any]) -> dict[str, float]:
    """Channel of recordings -> noise [SI]."""
    if result["rows"] or result["branches"]:
        return {}
    return {
        name: gap["floor"] / shown_unit(name)[1]
        for name, gap in result["gap"].items()
        if gap["floor"] is not None
    }


def _figures(
    result: Mapping[str, Any], comparisons: Sequence[Comparison], shown: Sequence[str]
) -> Iterator[tuple[str, Figure]]:
    yield first_figure(result)
    if result["learned"]:
        yield "learned", learned_curves(result["learned"])
    noise = _noise(result)
    for number, trial in enumerate(shown, 1):
        parts = [part for part in comparisons if part.trial == trial]
        yield f"trial_{number}", trial_channels(parts, noise)


def _grouped(names: Sequence[str]) -> str:
    """Names of trials, those that differ in their last number together."""
    stems = Counter(re.sub(r"[_ ]?\d+$", "", name) or name for name in names)
    return ", ".join(f"{stem} ({count})" for stem, count in stems.items())
