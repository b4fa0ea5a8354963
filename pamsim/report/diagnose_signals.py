"""Figures of single trials: measured and simulated signals, and the residual."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from pamsim.comparison.compared_signal import Comparison, shown_unit
from pamsim.report.numbers import words
from pamsim.report.style import BLUE, MUTED, RULE, VERMILION, finish_axes, new_figure, styled

MOST_TRIALS = 3
_MOST_POINTS = 1600  # of a line; more only make the file larger
_DASHED = (0, (3, 2))


def worst_trials(comparisons: Sequence[Comparison], noise: Mapping[str, float]) -> list[str]:
    """Held-out trials that the base model misses most, part of each protocol.

    Args:
        comparisons: every channel of every trial.
        noise: channel -> noise floor [SI].
    """
    missed: dict[str, list[float]] = {}
    protocol: dict[str, str] = {}
    for part in comparisons:
        if part.held_out and part.before is not None:
            ratio = float(np.mean((part.before - part.measured) ** 2)) / noise[part.channel] ** 2
            missed.setdefault(part.trial, []).append(ratio)
            protocol[part.trial] = part.protocol
    ordered = sorted(missed, key=lambda trial: -float(np.mean(missed[trial])))
    first = {protocol[trial]: trial for trial in reversed(ordered)}
    return [trial for trial in ordered if first[protocol[trial]] == trial][:MOST_TRIALS]


def _label(channel: str, unit: str) -> str:
    """A channel and its unit, on two lines where a joint or muscle stands in it."""
    owner, _, signal = channel.rpartition(".")
    return f"{words(owner)}\n{signal} [{unit}]" if owner else f"{words(signal)} [{unit}]"


@styled
def trial_channels(parts: Sequence[Comparison], noise: Mapping[str, Any]) -> Figure:
    """One trial, a row per channel: the signals, and measured minus simulated beside them.

    Args:
        parts: the channels of the trial.
        noise: channel -> noise floor [SI].
    """
    figure, axes = new_figure(0.75 + 1.35 * len(parts), rows=len(parts), columns=2, sharex=True)
    repaired = any(part.after is not None for part in parts)
    for row, part in enumerate(parts):
        signal, left = axes[2 * row], axes[2 * row + 1]
        shown, scale = shown_unit(part.channel)
        every = slice(None, None, max(1, part.time.size // _MOST_POINTS))
        time = part.time[every]
        signal.plot(time, part.measured[every] * scale, ".", color=MUTED, markersize=1.6)
        band = noise[part.channel] * scale
        left.axhspan(-2.0 * band, 2.0 * band, color=RULE, linewidth=0, zorder=0)
        for simulated, colour, style, width in (
            (part.before, VERMILION, _DASHED, 1.0),
            (part.after, BLUE, "-", 1.1),
        ):
            if simulated is not None:
                signal.plot(
                    time, simulated[every] * scale, color=colour, linestyle=style, linewidth=width
                )
                off = (part.measured - simulated)[every] * scale
                left.plot(time, off, color=colour, linewidth=0.8)
        last = row == len(parts) - 1
        finish_axes(
            signal,
            x="time [s]" if last else "",
            y=_label(part.channel, shown),
            title="signal" if row == 0 else "",
            zero=False,
        )
        finish_axes(
            left,
            x="time [s]" if last else "",
            y=f"[{shown}]",
            title="measured − simulated" if row == 0 else "",
        )
    handles = [
        Line2D([], [], color=MUTED, marker=".", linestyle="none", markersize=4, label="measured"),
        Line2D(
            [], [], color=VERMILION, linestyle=_DASHED, label="before" if repaired else "simulated"
        ),
        *([Line2D([], [], color=BLUE, label="after the repair")] if repaired else []),
        Patch(color=RULE, label="± 2 noise floors"),
    ]
    figure.legend(handles=handles, loc="outside upper right", ncols=len(handles))
    figure.align_ylabels()
    return figure
