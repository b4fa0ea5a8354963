"""Figures over time: the step responses of the paper's Figures 7 and 8, and the pressures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA
from pamsim.recordings.recording import Recording
from pamsim.report.style import (
    BLUE,
    FAINT,
    INK,
    MUTED,
    VERMILION,
    finish_axes,
    new_figure,
    say_empty,
    series_look,
    styled,
)

Row = Mapping[str, Any]
"""One of ``result["rows"]`` of schema ``pamsim-reproduce/1``."""

# The time axis ends at so many times the longest settling time of the figure.
SHOWN_SETTLING_TIMES = 2.5
# Share of the time axis kept right of the responses for the measured end angles.
_STRIP = 0.2


@styled
def large_medium_responses(rows: Sequence[Row], recordings: Mapping[int, Recording]) -> Figure:
    """The paper's Figure 7: responses of distinct rows to large (1-6) and medium (7-12) steps.

    Returns:
        Two panels, angle [deg] against time [s].
    """
    panels = {
        f"{size} steps": [row for row in rows if row["size"] == size]
        for size in ("large", "medium")
    }
    return _response_figure(panels, recordings)


@styled
def small_responses(rows: Sequence[Row], recordings: Mapping[int, Recording]) -> Figure:
    """The paper's Figure 8: responses of distinct rows to small pressure steps (rows 13-21).

    Returns:
        Two panels, without and with load, angle [deg] against time [s].
    """
    small = [row for row in rows if row["size"] == "small"]
    panels = {
        "small steps, no load": [row for row in small if row["load_kg"] == 0.0],
        "small steps, loaded": [row for row in small if row["load_kg"] != 0.0],
    }
    return _response_figure(panels, recordings)


def _response_figure(
    panels: Mapping[str, Sequence[Row]], recordings: Mapping[int, Recording]
) -> Figure:
    """Panels on top of each other that share both axes, so that sizes can be compared."""
    figure, axes = new_figure(6.3, rows=2, sharex=True, sharey=True)
    shown = [row for rows in panels.values() for row in rows]
    loads = sorted({row["load_kg"] for row in shown})
    end = _last_time_shown(shown, recordings)
    for ax, (title, rows) in zip(axes, panels.items(), strict=True):
        finish_axes(ax, y="angle β [deg]", title=title)
        ax.axvspan(end, end * (1 + _STRIP), color=FAINT, linewidth=0, zorder=0)
        for row in rows:
            _draw_response(ax, row, recordings.get(row["row"]), loads.index(row["load_kg"]), end)
        ax.set_xlim(0.0, end * (1 + _STRIP))
        ax.margins(y=0.12)
        ticks = MaxNLocator(nbins=8, steps=[1, 2, 5, 10]).tick_values(0.0, end)
        ax.set_xticks([tick for tick in ticks if 0.0 <= tick <= end * (1 + 1e-9)])
        if not any(row["row"] in recordings for row in rows):
            say_empty(ax, "no recording of these rows")
    axes[-1].set_xlabel("time after the step [s]")
    handles = []
    for index, load in enumerate(loads):
        colour, marker = series_look(index)
        look = {"color": colour, "marker": marker, "markersize": 5}
        handles.append(Line2D([], [], **look, label=_load(load)))
    look = {"color": MUTED, "marker": "o", "linestyle": "", "markersize": 5}
    handles.append(Line2D([], [], **look, label="measured end angle and row number"))
    figure.legend(handles=handles, loc="outside upper right", ncols=len(handles))
    return figure


def _load(load: float) -> str:
    return "no load" if load == 0.0 else f"{load:g} kg"


def _last_time_shown(rows: Sequence[Row], recordings: Mapping[int, Recording]) -> float:
    """End of the time axis [s]: cut only where every response is known to have settled before."""
    recorded = [row for row in rows if row["row"] in recordings]
    end = float(max((recordings[row["row"]].time[-1] for row in recorded), default=1.0))
    settling = [row["settling_s"] for row in recorded if row["settling_s"] is not None]
    if not settling or len(settling) < len(recorded):
        return end
    return min(end, max(1.0, SHOWN_SETTLING_TIMES * max(settling)))


def _draw_response(
    ax: Axes, row: Row, recording: Recording | None, load_index: int, end: float
) -> None:
    colour, marker = series_look(load_index)
    # One column of markers per load: the loads' end angles differ by less than a marker's size.
    slot = end * (1 + _STRIP * (0.2 + 0.28 * load_index))
    ax.plot(slot, row["measured_deg"], marker, color=colour, markersize=5, clip_on=False, zorder=4)
    ax.annotate(
        str(row["row"]),
        (slot, row["measured_deg"]),
        xytext=(4, 0),
        textcoords="offset points",
        va="center_baseline",
        fontsize=7.5,
        color=INK,
        # Links to the markers further right pass here.
        bbox={"facecolor": FAINT, "edgecolor": "none", "pad": 0.4},
    )
    if recording is None:
        return
    shown = recording.time <= end
    time, angle = recording.time[shown], recording.angle[shown] * DEG_PER_RAD
    ax.plot(time, angle, color=colour, linewidth=1.4, zorder=3)
    if row["outcome"] == "completed":
        link = ([time[-1], slot], [angle[-1], row["measured_deg"]])
        ax.plot(*link, color=colour, linewidth=0.8, linestyle=(0, (1, 1.5)), zorder=2)
    else:
        ax.plot(time[-1], angle[-1], "x", color=colour, markersize=7, zorder=4)


@styled
def pressure_courses(rows: Sequence[Row], recordings: Mapping[int, Recording]) -> Figure:
    """Both muscles' pressures in one large and one small step among distinct rows.

    Returns:
        Two panels, gauge pressure [kPa] against time [s], with the printed end pressures.
    """
    figure, axes = new_figure(3.5, columns=2, sharey=True)
    for ax, size in zip(axes, ("large", "small"), strict=True):
        finish_axes(ax, x="time after the step [s]", title=f"{size} step", zero=False)
        row = next((p for p in rows if p["size"] == size and p["row"] in recordings), None)
        if row is None:
            say_empty(ax, f"no recording of a {size} step")
            continue
        ax.set_title(f"{size} step: row {row['row']}, {_load(row['load_kg'])}")
        recording = recordings[row["row"]]
        pressure = recording.pressure / PA_PER_KPA
        printed = np.array([row["p1_kpa"], row["p2_kpa"]])
        end = recording.time[-1]
        for column, colour in enumerate((BLUE, VERMILION)):
            ax.plot(recording.time, pressure[:, column], color=colour)
            # Over the frame: a printed 0 kPa lies on the axis, at the very end.
            ax.plot(end, printed[column], "o", color=colour, markerfacecolor="white", clip_on=False)
            ax.annotate(
                f"$p_{column + 1}$",
                (end, pressure[-1, column]),
                xytext=(8, 0),
                textcoords="offset points",
                va="center",
                color=colour,
                annotation_clip=False,
            )
        ax.set_xlim(0.0, end)
        ax.set_ylim(bottom=0.0)
        ax.margins(y=0.08)
    axes[0].set_ylabel("gauge pressure [kPa]")
    handles = [
        Line2D([], [], color=MUTED, label="simulated"),
        Line2D([], [], color=MUTED, marker="o", mfc="white", linestyle="", label="printed end"),
    ]
    figure.legend(handles=handles, loc="outside upper right", ncols=2)
    return figure
