"""The page of a calibration: what moved, how well it fits, which numbers not to quote."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from pamsim.comparison.compared_signal import Comparison, shown_unit
from pamsim.core.units import to_si
from pamsim.report.numbers import digits, fixed, interval, sentence, significant, unit, words
from pamsim.report.page import write_page
from pamsim.report.style import RULE, finish_axes, new_figure, styled
from pamsim.report.trial_signals import shown_trials, trial_signals
from pamsim.scene.series_colours import BLUE, INK, MUTED, VERMILION

SCHEMA = "pamsim-calibrate/1"

_READABLE = 12  # parameters up to which a correlation is written into its field
_BEFORE: dict[str, Any] = {"color": INK, "markerfacecolor": "none", "markersize": 6}


def write_calibration(
    result: Mapping[str, Any], comparisons: Sequence[Comparison], out: Path
) -> Path:
    """Write page and figures of a calibration as `write_page` does; return the page."""
    trials = [c for c in comparisons if c.channel != "angle_at_rest"]
    return write_page(
        out,
        "calibrate.html",
        result,
        lambda: _figures(result, trials),
        schema=SCHEMA,
        headline=headline,
        shown_unit=shown_unit,
        shown=len(shown_trials(trials)),
        trials=len({c.trial for c in trials}),
    )


def _figures(result: Mapping[str, Any], trials: Sequence[Comparison]) -> dict[str, Figure]:
    parameters = result["parameters"]
    figures = {"parameters": parameter_ranges(parameters)}
    if len(parameters) > 1:
        matrix = result["fit"]["correlation"]
        figures["correlation"] = correlations(parameters, matrix)
    if trials:
        figures["trials"] = trial_signals(trials)
    tables = [trial for trial in result["trials"] if "rows" in trial]
    if tables:
        figures["rest"] = rest_errors(tables)
    if result["profiles"]:
        named = {parameter["name"]: parameter for parameter in parameters}
        figures["profiles"] = profile_curves(result["profiles"], named)
    return figures


def headline(result: Mapping[str, Any]) -> str:
    """What the calibration reached, in one line of numbers."""
    parts = [
        f"{words(row['channel'])}: {significant(row['before'], 2)} → {significant(row['after'], 2)}"
        f" {row['unit']}"
        for row in result["misfit"]
        if row["after"] is not None
    ]
    count = len(result["parameters"])
    fitted = f"{count} parameters" if count > 1 else "1 parameter"
    moved = f" RMS misfit, {', '.join(parts)}." if parts else ""
    return f"{fitted} fitted.{moved} {sentence(result['sentence'])}"


@styled
def parameter_ranges(parameters: Sequence[Mapping[str, Any]]) -> Figure:
    """Where each parameter lies in its range, before and after, with its 95 % interval."""
    figure, (ax,) = new_figure(1.1 + 0.36 * len(parameters))
    for row, parameter in enumerate(reversed(parameters)):
        written = parameter["written"]

        def place(value: float, p: Mapping[str, Any] = parameter) -> float:
            low, high = p["written"]["bounds"]
            if p["scale"] == "log":
                return float(np.log(value / low) / np.log(high / low))
            return (value - low) / (high - low)

        colour = VERMILION if parameter["flags"] else BLUE
        ax.plot([0.0, 1.0], [row, row], color=RULE, linewidth=5, solid_capstyle="butt", zorder=1)
        ends = written["interval95"]
        if ends is not None:
            inside = [min(max(place(end), 0.0), 1.0) for end in ends]
            ax.plot(
                inside, [row, row], color=colour, linewidth=2.2, solid_capstyle="butt", zorder=2
            )
        ax.plot(place(written["before"]), row, "o", zorder=3, **_BEFORE)
        ax.plot(place(written["value"]), row, "D", color=colour, markersize=4, zorder=4)
        for end, side, bound in zip((0.0, 1.0), ("left", "right"), written["bounds"], strict=True):
            ax.annotate(
                significant(bound, 3), (end, row), (0, 5), textcoords="offset points",
                ha=side, va="bottom", fontsize=7, color=MUTED,
            )  # fmt: skip
        between = interval(ends, digits(written["value"], ends))
        text = f"{between} {unit(written['unit'])}".rstrip() if between else "no interval"
        ax.text(1.02, row, text, va="center", fontsize=8, color=MUTED)
    ax.set_yticks(range(len(parameters)), [p["name"] for p in reversed(parameters)])
    ax.set_xlim(-0.02, 1.45)
    ax.set_ylim(-0.7, len(parameters) - 0.3)
    ax.set_xticks([0.0, 1.0], ["lowest allowed", "highest allowed"])
    finish_axes(ax, zero=False)
    ax.grid(False)
    ax.spines["left"].set_visible(False)
    ax.spines["bottom"].set_bounds(0.0, 1.0)
    ax.plot([], [], "o", label="before", **_BEFORE)
    ax.plot([], [], "D", color=BLUE, markersize=4, label="after")
    ax.plot([], [], color=BLUE, linewidth=2.2, label="95 % interval")
    figure.legend(loc="outside upper right", ncols=3)
    ax.tick_params(axis="y", length=0)
    return figure


@styled
def correlations(
    parameters: Sequence[Mapping[str, Any]], matrix: Sequence[Sequence[Any]]
) -> Figure:
    """Correlation of the estimates, as a matrix; None where a parameter has no interval."""
    names = [p["name"] for p in parameters]
    values = np.array([[np.nan if v is None else v for v in row] for row in matrix], dtype=float)
    figure, (ax,) = new_figure(1.6 + 0.42 * len(names))
    image = ax.imshow(values, cmap="RdBu_r", vmin=-1.0, vmax=1.0, aspect="auto")
    ax.set_xticks(range(len(names)), names, rotation=40, ha="right", rotation_mode="anchor")
    ax.set_yticks(range(len(names)), names)
    ax.tick_params(length=0)
    for spine in ax.spines.values():
        spine.set_visible(False)
    if len(names) <= _READABLE:
        for i, row in enumerate(values):
            for j, value in enumerate(row):
                if np.isfinite(value):
                    pale = abs(value) < 0.6
                    ax.text(
                        j, i, fixed(value, 2), ha="center", va="center", fontsize=7.5,
                        color=INK if pale else "white",
                    )  # fmt: skip
    figure.colorbar(image, ax=ax, shrink=0.8, label="correlation")
    return figure


@styled
def rest_errors(tables: Sequence[Mapping[str, Any]]) -> Figure:
    """Simulated minus measured angle of every row of the tables that were calibrated to."""
    figure, axes = new_figure(0.4 + 2.6 * len(tables), rows=len(tables))
    for ax, table in zip(axes, tables, strict=True):
        rows = table["rows"]
        at = np.arange(len(rows))
        measured = np.array([row["measured_deg"] for row in rows])
        for state, colour, marker, fill in (
            ("before", VERMILION, "o", "none"),
            ("after", BLUE, "D", BLUE),
        ):
            error = np.array([row[f"{state}_deg"] for row in rows], dtype=float) - measured
            if np.all(np.isfinite(error)):
                label = f"{state}: {fixed(np.sqrt(np.mean(error**2)), 2)} deg RMS"
                look = {"color": colour, "markerfacecolor": fill, "markersize": 4.5}
                ax.plot(at, error, marker, label=label, **look)
        ax.set_xticks(at, [row["row"].split(" ")[-1] for row in rows])
        title = f"{table['trial']}{', held out' if table['held_out'] else ''}"
        what = f"{rows[0]['row'].split(' ')[0]} of the table"
        finish_axes(ax, x=what, y="simulated − measured [deg]", title=title)
        ax.legend(loc="best")
        ax.axhline(0.0, color=INK, linewidth=0.7)
    return figure


@styled
def profile_curves(profiles: Sequence[Mapping[str, Any]], parameters: Mapping[str, Any]) -> Figure:
    """Profile likelihoods, one panel each, with the linear interval for comparison."""
    figure, axes = new_figure(0.3 + 2.7 * len(profiles), rows=len(profiles))
    for ax, profile in zip(axes, profiles, strict=True):
        parameter = parameters[profile["name"]]
        values = np.array(profile["values"])
        rise = np.array([np.nan if r is None else r for r in profile["rise"]], dtype=float)
        scale = to_si(1.0, parameter["unit"], parameter["written"]["unit"], where=profile["name"])
        ax.plot(values * scale, rise, "-o", color=BLUE, markersize=4, label="all others refitted")
        threshold = profile["threshold"]
        ax.axhline(threshold, color=MUTED, linewidth=0.9, linestyle=":")
        inside = parameter["written"]["interval95"]
        if inside is not None:
            ax.axvspan(*inside, color=RULE, alpha=0.5, zorder=0, label="linear 95 % interval")
        ax.set_ylim(-0.05 * threshold, 3.2 * threshold)
        finish_axes(
            ax,
            x=f"{profile['name']} [{unit(parameter['written']['unit']) or '–'}]",
            y="rise of −2 log likelihood",
            title=f"95 % at a rise of {significant(threshold, 3)}",
        )
        ax.legend(loc="best")
    return figure
