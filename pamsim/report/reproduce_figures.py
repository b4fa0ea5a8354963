"""Figures over rows of the result and models: the paper's Figures 6 and 9, and the errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from pamsim.core.units import FloatArray
from pamsim.report.numbers import number_or_none
from pamsim.report.style import (
    BLUE,
    FAINT,
    GREEN,
    INK,
    MUTED,
    PURPLE,
    VERMILION,
    finish_axes,
    new_figure,
    say_empty,
    series_look,
    styled,
)

Row = Mapping[str, Any]
"""One of ``result["rows"]`` of schema ``pamsim-reproduce/1``."""

SIZES = ("large", "medium", "small")
"""Of the pressure steps."""

# key of result["figure9"]: label, colour by model order, line by estimator
_MODELS: dict[str, tuple[str, str, dict[str, Any]]] = {
    "g1_output_error": ("$G_1$ output error", BLUE, {"linewidth": 1.5}),
    "g1_arx": ("$G_1$ ARX", BLUE, {"linewidth": 1.0, "linestyle": (0, (5, 2.5))}),
    "g1_paper": ("$G_1$ printed", BLUE, {"linewidth": 1.5, "linestyle": (0, (1, 1.6))}),
    "g2_output_error": ("$G_2$ output error", VERMILION, {"linewidth": 1.5}),
    "g2_arx": ("$G_2$ ARX", VERMILION, {"linewidth": 1.0, "linestyle": (0, (5, 2.5))}),
    "g2_paper": ("$G_2$ printed", VERMILION, {"linewidth": 1.5, "linestyle": (0, (1, 1.6))}),
}


@styled
def static_characteristic(rows: Sequence[Row], figure6: Mapping[str, Any]) -> Figure:
    """The paper's Figure 6: end angle against pressure difference.

    Args:
        rows: distinct rows of the result.
        figure6: ``p_svd_kpa`` (n,) [kPa], ``eq23_bar_deg`` and ``eq23_scaled_deg`` (n,) [deg],
            ``scale_kpa`` [kPa per unit of equation (23)], both curves' RMS [deg].

    Returns:
        One panel, angle [deg] against p1 - p2 [kPa].
    """
    figure, (ax,) = new_figure(4.3)
    finish_axes(ax, x="pressure difference $p_{svd} = p_1 - p_2$ [kPa]", y="end angle β [deg]")
    ax.axvline(0.0, color=MUTED, linewidth=0.7, zorder=1)
    x = _curve(figure6, "p_svd_kpa")
    scale = number_or_none(figure6.get("scale_kpa"))
    curves = (
        ("eq23_bar_deg", "rms_bar_deg", "eq. (23), p in bar", PURPLE, (0, (1, 1.6))),
        (
            "eq23_scaled_deg",
            "rms_scaled_deg",
            "eq. (23), best scale" + ("" if scale is None else f" {scale:.0f} kPa"),
            GREEN,
            (0, (5, 2.5)),
        ),
    )
    for key, rms_key, label, colour, dashes in curves:
        y = _curve(figure6, key)
        rms = number_or_none(figure6.get(rms_key))
        if x is not None and y is not None:
            text = label if rms is None else f"{label}: {rms:.1f} deg RMS"
            ax.plot(x, y, color=colour, linestyle=dashes, label=text)
    for row in rows:
        if row["simulated_deg"] is not None:
            pair = [row["measured_deg"], row["simulated_deg"]]
            ax.plot(
                [(row["p1_kpa"] - row["p2_kpa"])] * 2, pair, color=MUTED, linewidth=0.8, zorder=2
            )
    difference = [row["p1_kpa"] - row["p2_kpa"] for row in rows]
    measured = [row["measured_deg"] for row in rows]
    simulated = [_nan(row["simulated_deg"]) for row in rows]
    ax.plot(
        difference,
        simulated,
        "D",
        color=BLUE,
        markerfacecolor="none",
        markersize=6.5,
        label="simulated",
        zorder=3,
    )
    # On top and smaller, so that a dot inside a diamond means agreement.
    ax.plot(
        difference, measured, "o", color=INK, markersize=3.5, label="measured (printed)", zorder=4
    )
    # The characteristic rises from lower left to upper right: the lower right is always free.
    ax.legend(loc="lower right")
    return figure


@styled
def model_responses(figure9: Mapping[str, Any]) -> Figure:
    """The paper's Figure 9: first- and second-order models beside the simulated response.

    Args:
        figure9: ``time_s`` (n,) [s], ``simulated`` (n,) and up to six model responses (n,), all as
            shares of the simulated end value; a response that does not exist is null.

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

    Args:
        rows: distinct rows of the result.
        rms_deg: RMS of the errors [deg], drawn as a band; None for no band.

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
    for index, size in enumerate(SIZES):
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
