"""Static models compared: which physical term lowers the error at rows held out in turn."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullFormatter, NullLocator, ScalarFormatter

from pamsim.report.style import BLUE, INK, MUTED, VERMILION, finish_axes, new_figure, styled

TORQUE_LAW_DEG = 1.22
"""Error at rows held out in turn of a torque law of three terms without a muscle model [deg]."""

_TICKS = (0.7, 1.0, 1.5, 2.0, 3.0, 5.0, 8.0)
_LABEL = 38  # characters of a model's name that leave the marks two thirds of the width


@styled
def static_models_figure(models: Sequence[Mapping[str, Any]]) -> Figure:
    """Errors of every model in sample and at rows held out in turn.

    Args:
        models: each with ``name``, ``accepted``, ``rms_deg``, ``leave_one_out_rms_deg``.

    Returns:
        One panel: a line per model against RMS error [deg], logarithmic.
    """
    ordered = sorted(models, key=lambda model: not model["accepted"])
    names = ["\n".join(textwrap.wrap(model["name"], _LABEL)) for model in ordered]
    lines = sum(name.count("\n") + 1 for name in names)
    figure, (ax,) = new_figure(0.13 * (len(models) + lines) + 1.2)
    finish_axes(ax, x="RMS error of the end angle [deg]", zero=False)
    ax.grid(True, axis="x")
    ax.axvline(TORQUE_LAW_DEG, color=MUTED, linewidth=1.0, linestyle=(0, (4, 3)), zorder=1)
    for place, model in enumerate(ordered):
        inside, outside = model["rms_deg"], model["leave_one_out_rms_deg"]
        look = 1.0 if model["accepted"] else 0.45
        ax.plot([inside, outside], [place, place], color=MUTED, linewidth=1.0, zorder=2)
        for error, marker, colour in ((inside, "o", BLUE), (outside, "D", VERMILION)):
            ax.plot(error, place, marker, color=colour, alpha=look, markersize=5, zorder=3)
    for marker, colour, label in (
        ("o", BLUE, "in sample"),
        ("D", VERMILION, "rows held out in turn"),
    ):
        ax.plot([], [], marker, color=colour, label=label)
    ax.plot(
        [], [], color=MUTED, linestyle=(0, (4, 3)),
        label=f"torque law of three terms, held out: {TORQUE_LAW_DEG:g} deg",
    )  # fmt: skip
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
    figure.legend(loc="outside upper right", ncols=3)
    return figure
