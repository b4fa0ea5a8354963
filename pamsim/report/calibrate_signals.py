"""Figures of a calibration's fit: measured signals with the rig before and after, rows at rest."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pamsim.comparison.compared_signal import Comparison
from pamsim.core.units import DEG_PER_RAD, MM_PER_M, PA_PER_KPA
from pamsim.recordings.signals import kind_of, owner_of
from pamsim.report.numbers import fixed
from pamsim.report.style import (
    BLUE,
    INK,
    MUTED,
    VERMILION,
    finish_axes,
    new_figure,
    say_empty,
    series_look,
    styled,
)

MOST_TRIALS = 5

_KINDS = {
    "angle": ("angle β [deg]", DEG_PER_RAD),
    "position": ("position [mm]", MM_PER_M),
    "pressure": ("gauge pressure [kPa]", 1.0 / PA_PER_KPA),
    "force": ("force [N]", 1.0),
    "torque": ("torque [N m]", 1.0),
}
_DASHED = (0, (3, 2))
_MOST_POINTS = 400  # of measured samples drawn; more only make the file larger


@styled
def trial_signals(
    comparisons: Sequence[Comparison], names: tuple[str, str] = ("before", "after")
) -> Figure:
    """One row per trial, one column per kind of channel: measured, before, after.

    Args:
        comparisons: of all trials; the worst after the fit are drawn, held-out ones first.
        names: of the two simulations, where there are any.
    """
    chosen = shown_trials(comparisons)
    kinds = [
        k for k in _KINDS if any(kind_of(c.channel) == k and c.trial in chosen for c in comparisons)
    ]
    figure, axes = new_figure(
        0.9 + 1.75 * len(chosen), rows=len(chosen), columns=len(kinds), sharex="row"
    )
    held_out = {c.trial: c.held_out for c in comparisons}
    for i, trial in enumerate(chosen):
        for j, kind in enumerate(kinds):
            ax = axes[i * len(kinds) + j]
            parts = [c for c in comparisons if c.trial == trial and kind_of(c.channel) == kind]
            parts.sort(key=lambda part: part.channel)
            _signals(ax, kind, parts)
            finish_axes(
                ax,
                x="time [s]" if i == len(chosen) - 1 else "",
                y=_KINDS[kind][0],
                title=f"{trial} ({'held out' if held_out[trial] else 'fitted'})" if j == 0 else "",
                zero=False,
            )
    figure.legend(handles=_legend(comparisons, names), loc="outside upper right", ncols=5)
    return figure


def _legend(comparisons: Sequence[Comparison], simulations: tuple[str, str]) -> list[Line2D]:
    names: list[dict[str, None]] = []
    before, after = simulations
    for kind in _KINDS:
        channels = dict.fromkeys(c.channel for c in comparisons if kind_of(c.channel) == kind)
        for i, channel in enumerate(sorted(channels) if len(channels) > 1 else ()):
            names += [{}] if i == len(names) else []
            names[i][owner_of(channel) or f"muscle {channel.rpartition('_')[2]}"] = None
    return [
        Line2D([], [], color=MUTED, marker=".", linestyle="none", markersize=3, label="measured"),
        Line2D([], [], color=INK, linestyle=_DASHED, linewidth=0.9, label=before),
        *(
            [Line2D([], [], color=INK, linewidth=1.2, label=after)]
            if any(c.after is not None for c in comparisons)
            else []
        ),
        *(
            Line2D([], [], color=series_look(i)[0], linewidth=4, label=", ".join(own))
            for i, own in enumerate(names)
        ),
    ]


def shown_trials(comparisons: Sequence[Comparison]) -> list[str]:
    """Names of the trials that are drawn: held-out first, then the worst; of repeats, one."""

    def badness(trial: str) -> float:
        ends = [
            (c.measured, c.before if c.after is None else c.after)
            for c in comparisons
            if c.trial == trial
        ]
        return max(
            (
                float(np.sqrt(np.mean((end - measured) ** 2)) / (np.ptp(measured) or 1.0))
                for measured, end in ends
                if end is not None
            ),
            default=np.inf,
        )

    held = {c.trial: c.held_out for c in comparisons}
    protocol = {c.trial: c.protocol for c in comparisons}
    ordered = sorted(held, key=lambda trial: (not held[trial], -badness(trial)))
    first = {protocol[trial]: trial for trial in reversed(ordered)}
    return [trial for trial in ordered if first[protocol[trial]] == trial][:MOST_TRIALS]


def _signals(ax: Axes, kind: str, parts: Sequence[Comparison]) -> None:
    if not parts:
        say_empty(ax, "not measured")
        return
    scale = _KINDS[kind][1]
    for number, part in enumerate(parts):
        colour = series_look(number)[0] if len(parts) > 1 else INK
        every = max(1, part.time.size // _MOST_POINTS)
        ax.plot(
            part.time[::every],
            part.measured[::every] * scale,
            ".",
            color=MUTED,
            markersize=1.6,
        )
        if part.before is not None:
            ax.plot(
                part.time,
                part.before * scale,
                color=colour,
                linestyle=_DASHED,
                linewidth=0.9,
            )
        if part.after is not None:
            ax.plot(part.time, part.after * scale, color=colour, linewidth=1.2)


@styled
def rest_errors(tables: Sequence[Mapping[str, Any]]) -> Figure:
    """Simulated minus measured angle of every row of the static tables, before and after.

    Args:
        tables: entries with ``rows`` of a result of schema ``pamsim-calibrate/1``.
    """
    figure, axes = new_figure(0.4 + 2.6 * len(tables), rows=len(tables))
    for ax, table in zip(axes, tables, strict=True):
        rows = table["rows"]
        at = np.arange(len(rows))
        for key, colour, marker, label in (
            ("before_deg", VERMILION, "o", "before"),
            ("after_deg", BLUE, "D", "after"),
        ):
            values = [row[key] for row in rows]
            if None in values:
                continue
            error = np.array([row[key] - row["measured_deg"] for row in rows])
            ax.plot(
                at,
                error,
                marker,
                color=colour,
                markersize=4.5,
                markerfacecolor="none" if key == "before_deg" else colour,
                label=f"{label}: {fixed(np.sqrt(np.mean(error**2)), 2)} deg RMS",
            )
        ax.set_xticks(at, [row["row"].split(" ")[-1] for row in rows])
        held = ", held out" if table["held_out"] else ""
        finish_axes(
            ax,
            x=f"{rows[0]['row'].split(' ')[0]} of the table",
            y="simulated − measured [deg]",
            title=f"{table['trial']}{held}",
        )
        ax.legend(loc="best")
        ax.axhline(0.0, color=INK, linewidth=0.7)
    return figure
