"""Figures of the reproduction: the paper's Figures 6 to 9, errors, and static models compared."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator, ScalarFormatter

from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA, FloatArray
from pamsim.recordings.recording import Recording
from pamsim.report.replication_figures import DASHED, DOTTED, equation_23
from pamsim.report.style import FAINT, finish_axes, new_figure, say_empty, series_look, styled
from pamsim.scene.series_colours import BLUE, GREEN, INK, MUTED, VERMILION

Row = Mapping[str, Any]
"""One of ``result["rows"]`` of schema ``pamsim-reproduce/1``."""

# The time axis ends at so many times the longest settling time of the figure.
SHOWN_SETTLING_TIMES = 2.5
# Share of the time axis kept right of the responses for the measured end angles.
_STRIP = 0.2
_TICKS = (0.7, 1.0, 1.5, 2.0, 3.0, 5.0, 8.0, 15.0)
_LABEL = 38  # characters of a model's name that leave the marks two thirds of the width
_MARKS = (
    ("rms_deg", "o", BLUE, "in sample"),
    ("leave_one_out_rms_deg", "D", VERMILION, "rows held out in turn"),
    ("small steps", "^", GREEN, "small steps held out"),
)

# key of result["figure9"]: label, colour by model order, line by estimator
_LINES: dict[str, tuple[str, dict[str, Any]]] = {
    "output_error": ("output error", {"linewidth": 1.5}),
    "arx": ("ARX", {"linewidth": 1.0, "linestyle": DASHED}),
    "paper": ("printed", {"linewidth": 1.5, "linestyle": DOTTED}),
}
_MODELS: dict[str, tuple[str, str, dict[str, Any]]] = {
    f"g{order}_{key}": (f"$G_{order}$ {label}", colour, line)
    for order, colour in ((1, BLUE), (2, VERMILION))
    for key, (label, line) in _LINES.items()
}


@styled
def static_characteristic(rows: Sequence[Row], figure6: Mapping[str, Any]) -> Figure:
    """The paper's Figure 6: end angle [deg] against p1 - p2 [kPa], of the distinct rows."""
    figure, (ax,) = new_figure(4.3)
    scaled = f"eq. (23), best scale {figure6['scale_kpa']:.0f} kPa"
    equation_23(ax, figure6, "eq. (23), p in bar", scaled)
    difference = [row["p1_kpa"] - row["p2_kpa"] for row in rows]
    for x, row in zip(difference, rows, strict=True):
        if row["simulated_deg"] is not None:
            pair = [row["measured_deg"], row["simulated_deg"]]
            ax.plot([x] * 2, pair, color=MUTED, linewidth=0.8, zorder=2)
    simulated = np.array([row["simulated_deg"] for row in rows], dtype=float)  # NaN for None
    diamond = {"color": BLUE, "markerfacecolor": "none", "markersize": 6.5}
    ax.plot(difference, simulated, "D", **diamond, label="simulated", zorder=3)
    # On top and smaller, so that a dot inside a diamond means agreement.
    measured = [row["measured_deg"] for row in rows]
    dot = {"color": INK, "markersize": 3.5}
    ax.plot(difference, measured, "o", **dot, label="measured (printed)", zorder=4)
    # The characteristic rises from lower left to upper right: the lower right is always free.
    ax.legend(loc="lower right")
    return figure


@styled
def model_responses(figure9: Mapping[str, Any]) -> Figure:
    """The paper's Figure 9: first- and second-order models beside the simulated response.

    All are shares of the simulated end value; a response that does not exist is null.
    """
    figure, (upper, lower) = new_figure(5.6, rows=2, sharex=True, height_ratios=(1.6, 1.0))
    finish_axes(upper, y="normalised angle [-]")
    finish_axes(lower, x="time after the step [s]", y="model − simulation [-]")
    time = _curve(figure9, "time_s")
    simulated = _curve(figure9, "simulated")
    if time is None or simulated is None:
        say_empty(upper, "the result has no simulated response to identify models from")
        return figure
    upper.axhline(1.0, color=MUTED, linewidth=0.7, zorder=1)
    upper.plot(time, simulated, color=INK, linewidth=3.2, alpha=0.35, label="simulated")
    for key, (label, colour, line) in _MODELS.items():
        response = _curve(figure9, key)
        if response is not None:
            upper.plot(time, response, color=colour, label=label, **line)
            lower.plot(time, response - simulated, color=colour, **line)
    lower.set_xlim(time[0], time[-1])
    # A step response ends high: the lower right is free.
    upper.legend(loc="lower right", ncols=2, bbox_to_anchor=(1.0, 0.08))
    return figure


@styled
def errors_by_row(rows: Sequence[Row], rms_deg: float | None) -> Figure:
    """Error of every distinct row, their RMS as a band, and below it the angle it belongs to."""
    figure, (upper, lower) = new_figure(4.4, rows=2, sharex=True, height_ratios=(1.7, 1.0))
    finish_axes(upper, y="error [deg]")
    finish_axes(lower, x="row of Tables 1 and 2", y="measured |β| [deg]", zero=False)
    used: list[Patch] = []
    if rms_deg is not None:
        band = upper.axhspan(-rms_deg, rms_deg, color=FAINT, zorder=0, linewidth=0)
        band.set_label(f"± RMS {rms_deg:.2f} deg")
        used.append(band)
    for index, size in enumerate(("large", "medium", "small")):
        colour, marker = series_look(index)
        chosen = [row for row in rows if row["size"] == size]
        numbers = [row["row"] for row in chosen]
        errors = np.array([row["error_deg"] for row in chosen], dtype=float)  # NaN for None
        upper.vlines(numbers, 0.0, errors, color=colour, linewidth=1.6)
        upper.plot(numbers, errors, marker, color=colour, markersize=6)
        lower.bar(numbers, [abs(p["measured_deg"]) for p in chosen], width=0.55, color=colour)
        if chosen:
            used.append(Patch(color=colour, label=f"{size} step"))
        for row in chosen:
            if row["error_deg"] is None:
                upper.annotate("no result", (row["row"], 0.0), ha="center", fontsize=7.5)
    lower.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=24, steps=[1]))
    lower.set_xlim(min(p["row"] for p in rows) - 0.7, max(p["row"] for p in rows) + 0.7)
    upper.margins(y=0.12)
    figure.legend(handles=used, loc="outside upper right", ncols=len(used))
    return figure


def _curve(data: Mapping[str, Any], key: str) -> FloatArray | None:
    values = data.get(key)
    return None if values is None else np.asarray(values, dtype=float)


@styled
def large_medium_responses(rows: Sequence[Row], recordings: Mapping[int, Recording]) -> Figure:
    """The paper's Figure 7: responses of distinct rows to large (1-6) and medium (7-12) steps."""
    large, medium = ([row for row in rows if row["size"] == size] for size in ("large", "medium"))
    return _response_figure({"large steps": large, "medium steps": medium}, recordings)


@styled
def small_responses(rows: Sequence[Row], recordings: Mapping[int, Recording]) -> Figure:
    """The paper's Figure 8: responses of distinct rows to small pressure steps (rows 13-21)."""
    free, loaded = (
        [row for row in rows if row["size"] == "small" and bool(row["load_kg"]) is load]
        for load in (False, True)
    )
    panels = {"small steps, no load": free, "small steps, loaded": loaded}
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
            _draw_response(ax, row, recordings[row["row"]], loads.index(row["load_kg"]), end)
        ax.set_xlim(0.0, end * (1 + _STRIP))
        ax.margins(y=0.12)
        ticks = MaxNLocator(nbins=8, steps=[1, 2, 5, 10]).tick_values(0.0, end)
        ax.set_xticks([tick for tick in ticks if 0.0 <= tick <= end * (1 + 1e-9)])
    axes[-1].set_xlabel("time after the step [s]")
    styles: list[tuple[str, str, Any, str]] = [
        (*series_look(index), "-", _load(load)) for index, load in enumerate(loads)
    ]
    styles.append((MUTED, "o", "", "measured end angle and row number"))
    handles = [
        Line2D([], [], color=colour, marker=marker, markersize=5, linestyle=line, label=text)
        for colour, marker, line, text in styles
    ]
    figure.legend(handles=handles, loc="outside upper right", ncols=len(handles))
    return figure


def _load(load: float) -> str:
    return "no load" if load == 0.0 else f"{load:g} kg"


def _last_time_shown(rows: Sequence[Row], recordings: Mapping[int, Recording]) -> float:
    """End of the time axis [s]: cut only where every response is known to have settled before."""
    end = float(max(recordings[row["row"]].time[-1] for row in rows))
    settling = [row["settling_s"] for row in rows]
    return end if None in settling else min(end, max(1.0, SHOWN_SETTLING_TIMES * max(settling)))


def _draw_response(ax: Axes, row: Row, recording: Recording, load_index: int, end: float) -> None:
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
    """Both muscles' pressures in one large and one small step, with the printed end pressures."""
    figure, axes = new_figure(3.5, columns=2, sharey=True)
    for ax, size in zip(axes, ("large", "small"), strict=True):
        finish_axes(ax, x="time after the step [s]", title=f"{size} step", zero=False)
        row = next(row for row in rows if row["size"] == size)
        ax.set_title(f"{size} step: row {row['row']}, {_load(row['load_kg'])}")
        recording = recordings[row["row"]]
        end = recording.time[-1]
        for i, pressure in enumerate(recording.pressure.T / PA_PER_KPA):
            colour, _ = series_look(i)
            ax.plot(recording.time, pressure, color=colour)
            # Over the frame: a printed 0 kPa lies on the axis, at the very end.
            printed: dict[str, Any] = {"markerfacecolor": "white", "clip_on": False}
            ax.plot(end, row[f"p{i + 1}_kpa"], "o", color=colour, **printed)
            ax.annotate(
                f"$p_{i + 1}$", (end, pressure[-1]), (8, 0), textcoords="offset points",
                va="center", color=colour, annotation_clip=False,
            )  # fmt: skip
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


@styled
def static_models_figure(
    models: Sequence[Mapping[str, Any]], calibration: Mapping[str, Any]
) -> Figure:
    """Errors of every model in sample, at rows held out in turn and at the small steps held out."""
    ordered = sorted(models, key=lambda model: not model["accepted"])
    names = ["\n".join(textwrap.wrap(model["name"], _LABEL)) for model in ordered]
    lines = sum(name.count("\n") + 1 for name in names)
    figure, (ax,) = new_figure(0.13 * (len(models) + lines) + 1.7)
    finish_axes(ax, x="RMS error of the end angle [deg]", zero=False)
    ax.grid(True, axis="x")
    for place, model in enumerate(ordered):
        look = 1.0 if model["accepted"] else 0.45
        found: dict[str, Any] = {**model, **model["left_out_block_rms_deg"]}
        shown = [
            (found[key], marker, colour)
            for key, marker, colour, _ in _MARKS
            if found.get(key) is not None
        ]
        ends = [error for error, _, _ in shown]
        ax.plot([min(ends), max(ends)], [place] * 2, color=MUTED, linewidth=1.0, zorder=2)
        for error, marker, colour in shown:
            ax.plot(error, place, marker, color=colour, alpha=look, markersize=5, zorder=3)
    for _, marker, colour, label in _MARKS:
        ax.plot([], [], marker, color=colour, label=label)
    nested = calibration["nested_leave_one_out"]["rms_deg"]
    best = calibration["best_torque_laws"]
    for error, colour, style, label in (
        (nested, VERMILION, "solid", "nested: form chosen without the row"),
        (best["leave_one_out_rms_deg"], VERMILION, (0, (4, 3)), "best torque law, rows"),
        (best["small_steps_rms_deg"], GREEN, (0, (1, 2)), "best torque law, small steps"),
    ):
        text = f"{label}: {error:.2f} deg"
        ax.axvline(error, color=colour, linewidth=1.0, linestyle=style, zorder=1, label=text)
    ax.set_xscale("log")
    ax.set_xticks(_TICKS)
    ax.set_xticks([], minor=True)
    ax.xaxis.set_major_formatter(ScalarFormatter())
    ax.set_yticks(range(len(ordered)), names, fontsize=8, linespacing=1.0)
    for label, model in zip(ax.get_yticklabels(), ordered, strict=True):
        label.set_color(INK if model["accepted"] else MUTED)
    ax.set_ylim(len(ordered) - 0.4, -0.6)
    ax.grid(False, axis="y")
    figure.legend(loc="outside upper right", ncols=2)
    return figure
