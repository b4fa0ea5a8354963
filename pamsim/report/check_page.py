"""The page of a check: measured and simulated signals, what is implausible, what could be seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from pamsim.comparison.compared_signal import Comparison
from pamsim.report.numbers import fixed, plain, words
from pamsim.report.page import write_page
from pamsim.report.style import finish_axes, new_figure, styled
from pamsim.report.trial_signals import shown_trials, trial_signals
from pamsim.scene.series_colours import BLUE, INK, MUTED

SCHEMA = "pamsim-check/2"

AS_IT_IS = "rig as it is", ""
"""Names of the simulations beside the trials of a check."""

_LINE = 0.19  # height of an effect's line [in]
_WIDEST = 1e3  # ratio beyond which an effect is drawn at the edge


def write_check(result: Mapping[str, Any], comparisons: Sequence[Comparison], out: Path) -> Path:
    """Write page and figures of a check as `write_page` does; return the page.

    Args:
        result: of schema ``pamsim-check/2``.
        comparisons: every channel of every trial beside the rig as it is.
        out: folder.
    """
    return write_page(
        out,
        "check.html",
        result,
        lambda: _figures(result, comparisons),
        schema=SCHEMA,
        headline=headline,
        shown=len(shown_trials(comparisons)),
    )


def headline(result: Mapping[str, Any]) -> str:
    """What the recordings are, in one line."""
    found = len(result["suspicions"])
    trials = sum(result["protocols"].values())
    plausible = "Nothing is implausible" if not found else f"{plain(found)} suspicious"
    return (
        f"{plain(trials)} trials of {plain(len(result['protocols']))} inputs,"
        f" {fixed(result['seconds'], 0)} s. {plausible}; {plain(len(result['seen']))} of"
        f" {plain(len(result['effects']))} effects would show at their typical size."
    )


def _figures(result: Mapping[str, Any], comparisons: Sequence[Comparison]) -> dict[str, Figure]:
    figures = {"signals": trial_signals(comparisons, AS_IT_IS)}
    if result["effects"]:
        figures["effects"] = visible_sizes(result["effects"])
    return figures


@styled
def visible_sizes(effects: Sequence[Mapping[str, Any]]) -> Figure:
    """For each effect, the clearest first, the share of its typical size from which it shows."""
    figure, (ax,) = new_figure(0.8 + _LINE * len(effects))
    at = np.arange(len(effects))
    sizes = [np.inf if one["shows_from"] is None else one["shows_from"] for one in effects]
    ratios = np.minimum(np.divide(sizes, [one["typical"] for one in effects]), _WIDEST)
    seen = np.array([one["seen"] for one in effects])
    ax.hlines(at, np.minimum(ratios, 1.0), np.maximum(ratios, 1.0), color=MUTED, linewidth=0.8)
    ax.plot(ratios[seen], at[seen], "o", color=BLUE, markersize=4.5)
    ax.plot(ratios[~seen], at[~seen], "o", color=INK, markerfacecolor="none", markersize=4.5)
    ax.set_xscale("log")
    ax.set_yticks(at, [words(one["name"]) for one in effects])
    ax.set_ylim(len(effects) - 0.4, -0.6)
    ax.axvline(1.0, color=INK, linewidth=0.8)
    finish_axes(ax, x="shows from, in typical sizes", zero=False)
    ax.grid(True, axis="x")
    ax.grid(False, axis="y")
    return figure
