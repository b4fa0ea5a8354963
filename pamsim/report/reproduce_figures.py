"""Figures over rows of the result and models: the paper's Figures 6 and 9, and the errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from pamsim.core.units import FloatArray
from pamsim.report.replication_statics import DASHED, DOTTED, equation_23
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
    simulated = [_nan(row["simulated_deg"]) for row in rows]
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

    Returns:
        Two panels against time [s]: responses [-], and models minus simulation [-].
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
    """Error of every distinct row, and below it the measured angle that it belongs to.

    The RMS of the errors [deg] is drawn as a band, if there is one.

    Returns:
        Two panels against the row number: error [deg] and measured magnitude [deg].
    """
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
        errors = [_nan(row["error_deg"]) for row in chosen]
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
    return None if values is None or len(values) == 0 else np.asarray(values, dtype=float)


def _nan(value: float | None) -> float:
    return np.nan if value is None else value
