"""The page of a diagnosis by link: where the gap is, what is missing, what could be instead."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from pamsim.comparison.compared_signal import Comparison, shown_unit
from pamsim.inference.model_comparison import DRAWN
from pamsim.inference.permutation import ORDERS
from pamsim.recordings.signals import JOINT_KINDS, kind_of
from pamsim.report.diagnosis_headline import Hidden, headline
from pamsim.report.link_figure import learned_curves, link_bars
from pamsim.report.numbers import fixed, words
from pamsim.report.page import inline_image, write_page
from pamsim.report.row_errors import loop_branches, row_errors
from pamsim.report.trial_signals import trial_channels, worst_trials

SCHEMA = "pamsim-diagnosis/3"

SUPPORTED: Mapping[str, tuple[str, str]] = {
    "no_gap": (
        "on data that no fit has seen the model misses by no more than its noise",
        "that the model is right: what the inputs do not excite is not tested",
    ),
    "named": (
        "this effect is missing, with this interval; every other effect tried predicts worse",
        "that nothing else could be the cause: only the effects tried were compared",
    ),
    "named_with_remainder": (
        "this effect is missing, and something else is left",
        "that its size is exact: what is left may bias it",
    ),
    "ambiguous": (
        "what is called certain, and no more",
        "the nearest formula as the cause",
    ),
    "unexplained": (
        "where simulation and measurement part, and that no effect tried explains it",
        "the nearest effect, or a learned curve, as the cause",
    ),
    "undecided": (
        "that no effect tried predicts unseen parts of the recording better",
        "that the model agrees, or that something is missing: no repeats show which",
    ),
}
"""Verdict -> what a paper may state of it, and what not."""


def write_link_diagnosis(
    result: Mapping[str, Any],
    comparisons: Sequence[Comparison],
    out: Path,
    *,
    film: Path | None = None,
    hidden: Hidden | None = None,
) -> list[Path]:
    """Write page and figures of a diagnosis by link as `write_page` does.

    Args:
        result: of schema ``pamsim-diagnosis/3``.
        comparisons: every compared channel of every trial, the whole chain simulated.
        out: folder.
        film: a GIF of the first trial shown, see `pamsim.report.gap_film`, or None.
        hidden: what was hidden in synthetic recordings, with which the page then begins.
    """
    shown = shown_trials(result, comparisons)
    picture = hidden and hidden.picture
    return write_page(
        out,
        "link_diagnosis.html",
        result,
        lambda: dict(_figures(result, comparisons, shown)),
        schema=SCHEMA,
        headline=hidden.headline(result) if hidden else headline(result),
        supported=SUPPORTED,
        shown=shown,
        hidden=hidden,
        picture=picture and inline_image(picture.read_bytes(), "jpeg"),
        film=None if film is None else inline_image(film.read_bytes(), "gif"),
        filmed=_filmed(comparisons, shown),
        least=_least_p_value(result),
        grouped=_grouped,
    )


def shown_trials(result: Mapping[str, Any], comparisons: Sequence[Comparison]) -> list[str]:
    """Held-out trials that the page shows, the one with the largest gap first."""
    return worst_trials(comparisons, _noise(result))


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


def _filmed(comparisons: Sequence[Comparison], shown: Sequence[str]) -> str:
    """What the film of the first trial shows, with the misfits of its first joint."""
    joints = [c for c in comparisons if c.trial in shown[:1] and kind_of(c.channel) in JOINT_KINDS]
    if not joints:
        return ""
    first = joints[0]
    of = shown_unit(first.channel)[0]
    before, after = (
        f"{fixed(first.rms(values), 2)} {of}" if values is not None else ""
        for values in (first.before, first.after)
    )
    text = f"as measured; as simulated, {words(first.channel)} off by {before or 'no number'} RMS"
    return f"{text} before the repair and by {after} after it" if after else text


def _least_p_value(result: Mapping[str, Any]) -> float:
    """Smallest p-value: of flips of so many units' signs, and at rest of orders of the rows."""
    held_out = len(result["run"]["held_out"]) if result["run"] else math.inf
    at_rest = result["rows"] or result["branches"]
    return max(0.5**held_out, 1.0 / ((ORDERS if at_rest else DRAWN) + 1))


def _grouped(names: Sequence[str]) -> str:
    """Names of trials, those that differ in their last number together."""
    stems = Counter(re.sub(r"[_ ]?\d+$", "", name) or name for name in names)
    return ", ".join(f"{stem} ({n})" if n > 1 else stem for stem, n in stems.items())
