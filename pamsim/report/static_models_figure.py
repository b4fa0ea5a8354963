"""Static models compared: which physical term lowers the error at held-out rows."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullFormatter, NullLocator, ScalarFormatter

from pamsim.report.style import (
    BLUE,
    GREEN,
    INK,
    MUTED,
    VERMILION,
    finish_axes,
    new_figure,
    styled,
)

_TICKS = (0.7, 1.0, 1.5, 2.0, 3.0, 5.0, 8.0, 15.0)
_LABEL = 38  # characters of a model's name that leave the marks two thirds of the width
_DASHED, _DOTTED = (0, (4, 3)), (0, (1, 2))


_MARKS = (
    ("rms_deg", "o", BLUE, "in sample"),
    ("leave_one_out_rms_deg", "D", VERMILION, "rows held out in turn"),
    ("small steps", "^", GREEN, "small steps held out"),
)


@styled
def static_models_figure(
    models: Sequence[Mapping[str, Any]], calibration: Mapping[str, Any]
) -> Figure:
    """Errors of every model in sample, at rows held out in turn and at the small steps held out.

    Args:
        models: each with ``name``, ``accepted``, ``rms_deg``, ``leave_one_out_rms_deg``,
            ``left_out_block_rms_deg``.
        calibration: with ``best_torque_laws`` and ``nested_leave_one_out``.

    Returns:
        One panel: a line per model against RMS error [deg], logarithmic.
    """
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
        (best["leave_one_out_rms_deg"], VERMILION, _DASHED, "best torque law, rows"),
        (best["small_steps_rms_deg"], GREEN, _DOTTED, "best torque law, small steps"),
    ):
        text = f"{label}: {error:.2f} deg"
        ax.axvline(error, color=colour, linewidth=1.0, linestyle=style, zorder=1, label=text)
    ax.set_xscale("log")
    ax.xaxis.set_major_locator(FixedLocator(_TICKS))
    ax.xaxis.set_major_formatter(ScalarFormatter())
    ax.xaxis.set_minor_locator(NullLocator())
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.set_yticks(range(len(ordered)), names, fontsize=8, linespacing=1.0)
    for label, model in zip(ax.get_yticklabels(), ordered, strict=True):
        label.set_color(INK if model["accepted"] else MUTED)
    ax.set_ylim(len(ordered) - 0.4, -0.6)
    ax.grid(False, axis="y")
    figure.legend(loc="outside upper right", ncols=2)
    return figure
