"""Figures of a diagnosis in numbers: the gap per channel, nuisance parameters per protocol."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pamsim.report.numbers import p_is, significant, unit, words
from pamsim.report.style import (
    BLUE,
    GREEN,
    INK,
    RULE,
    VERMILION,
    finish_axes,
    new_figure,
    styled,
)

MOST_PARAMETERS = 4


@styled
def gap_bars(result: Mapping[str, Any]) -> Figure:
    """Held-out root mean square before and after, over the noise floor, with 95 % intervals.

    Args:
        result: of recordings, of schema ``pamsim-diagnosis/2``.
    """
    gap = result["gap"]
    repaired = any(entry["after"] is not None for entry in gap.values())
    first = GREEN if result["verdict"] == "no_gap" else VERMILION
    figure, (ax,) = new_figure(1.0 + 0.55 * len(gap))
    entries = list(gap.items())[::-1]
    for row, (_, entry) in enumerate(entries):
        floor = entry["floor"]
        ends = floor["interval95"]
        if ends is not None:
            low, high = (end / floor["value"] for end in ends)
            ax.fill_betweenx([row - 0.4, row + 0.4], low, high, color=RULE, linewidth=0, zorder=1)
        ax.plot([1.0, 1.0], [row - 0.4, row + 0.4], color=INK, linewidth=1.3, zorder=4)
        _bar(ax, row + 0.18, entry["before"], floor["value"], first)
        if entry["after"] is not None:
            _bar(ax, row - 0.18, entry["after"], floor["value"], BLUE)
    labels = [f"{words(name)}\n{_levels(entry)}" for name, entry in entries]
    ax.set_yticks(range(len(gap)), labels)
    ax.set_ylim(-0.6, len(gap) - 0.4)
    ax.set_xlim(left=0.0)
    over = result["gap_over_floor"].values()
    levels = " → ".join(significant(level, 3) for level in over if level is not None)
    title = f"all channels: {levels} times the noise floor" if levels else ""
    finish_axes(ax, x="held-out RMS / noise floor", title=title, zero=False)
    ax.grid(False, axis="y")
    ax.grid(True, axis="x")
    ax.tick_params(axis="y", length=0)
    ax.plot([], [], color=first, linewidth=5, label="before" if repaired else "simulated")
    if repaired:
        ax.plot([], [], color=BLUE, linewidth=5, label="after the repair")
    ax.plot([], [], color=INK, linewidth=1.3, label="noise floor")
    if any(entry["floor"]["interval95"] is not None for entry in gap.values()):
        ax.plot([], [], color=RULE, linewidth=7, label="its 95 % interval")
    figure.legend(loc="outside upper right", ncols=4)
    return figure


def _levels(entry: Mapping[str, Any]) -> str:
    levels = [entry["before"], entry["after"]]
    shown = " → ".join(significant(level["value"], 3) for level in levels if level is not None)
    return f"{shown} {entry['unit']}"


def _bar(ax: Axes, at: float, level: Mapping[str, Any], floor: float, colour: str) -> None:
    value = level["value"] / floor
    ax.barh(at, value, height=0.3, color=colour, zorder=2)
    if level["interval95"] is not None:
        ends = [end / floor for end in level["interval95"]]
        ax.plot(ends, [at, at], color=INK, linewidth=0.9, zorder=5, marker="|", markersize=6)


@styled
def nuisance_by_protocol(entries: Sequence[Mapping[str, Any]]) -> Figure:
    """Nuisance parameters fitted to each protocol: differences show which part is wrong.

    Args:
        entries: of a result of schema ``pamsim-diagnosis/2``.
    """
    shown = list(entries)[:MOST_PARAMETERS]
    protocols = list(dict.fromkeys(p for entry in shown for p in entry["values"]))
    figure, axes = new_figure(0.9 + 0.24 * len(protocols), columns=len(shown), sharey=True)
    for ax, entry in zip(axes, shown, strict=True):
        for row, protocol in enumerate(reversed(protocols)):
            fit = entry["values"].get(protocol)
            if fit is None:
                continue
            ax.plot(fit["interval95"], [row, row], color=BLUE, linewidth=1.6)
            ax.plot(fit["value"], row, "o", color=BLUE, markersize=4)
        shown_unit = unit(entry["unit"])
        finish_axes(
            ax,
            x=f"{entry['parameter']}{f' [{shown_unit}]' if shown_unit else ''}",
            title=p_is(entry["p_value"]),
            zero=False,
        )
        ax.locator_params(axis="x", nbins=3)
    axes[0].set_yticks(range(len(protocols)), [words(p) for p in reversed(protocols)])
    axes[0].set_ylim(-0.5, len(protocols) - 0.5)
    return figure
