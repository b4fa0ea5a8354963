"""The ladder of static models: which physical term lowers the error at rows it has not seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullFormatter, NullLocator, ScalarFormatter

from pamsim.report.numbers import fixed, interval, significant, unit
from pamsim.report.style import BLUE, MUTED, VERMILION, finish_axes, new_figure, styled

TORQUE_LAW_DEG = 1.22
"""Error at unseen rows of the best torque law of three terms without any muscle model [deg]."""

_TICKS = (0.7, 1.0, 1.5, 2.0, 3.0, 5.0, 8.0)


@dataclass(frozen=True)
class RungView:
    """One line of the table of static models."""

    name: str
    climbed: bool
    rms: str
    left_out: str
    parameters: list[str]


def rung_views(rungs: Sequence[Mapping[str, Any]]) -> list[RungView]:
    """Prepare the table of static models.

    Args:
        rungs: each with ``name``, ``climbed``, ``rms_deg``, ``loo_rms_deg``, ``parameters``.

    Returns:
        One line per model, in the order given.
    """
    return [
        RungView(
            name=str(rung["name"]),
            climbed=bool(rung["climbed"]),
            rms=fixed(rung["rms_deg"], 2),
            left_out=fixed(rung["loo_rms_deg"], 2),
            parameters=[_parameter(found) for found in rung["parameters"]],
        )
        for rung in rungs
    ]


def _parameter(found: Mapping[str, Any]) -> str:
    text = f"{found['name']} = {significant(found['value'], 3)} {unit(found['unit'])}".rstrip()
    between = interval(found["interval95"], 3)
    doubts = ", ".join(str(doubt).replace("_", " ") for doubt in found["doubts"])
    return text + (f" ({between})" if between else "") + (f"; {doubts}" if doubts else "")


@styled
def static_ladder(rungs: Sequence[Mapping[str, Any]]) -> Figure:
    """Errors of every model in sample and at unseen rows.

    Args:
        rungs: each with ``name``, ``climbed``, ``rms_deg``, ``loo_rms_deg``.

    Returns:
        One panel: a line per model against RMS error [deg], logarithmic.
    """
    figure, (ax,) = new_figure(0.27 * len(rungs) + 1.2)
    finish_axes(ax, x="RMS error of the end angle [deg], logarithmic", zero=False)
    ax.grid(True, axis="x")
    ax.axvline(TORQUE_LAW_DEG, color=MUTED, linewidth=1.0, linestyle=(0, (4, 3)), zorder=1)
    ordered = [rung for rung in rungs if rung["climbed"]]
    ordered += [rung for rung in rungs if not rung["climbed"]]
    for place, rung in enumerate(ordered):
        inside, outside = float(rung["rms_deg"]), float(rung["loo_rms_deg"])
        look = 1.0 if rung["climbed"] else 0.45
        ax.plot([inside, outside], [place, place], color=MUTED, linewidth=1.0, zorder=2)
        ax.plot(inside, place, "o", color=BLUE, alpha=look, markersize=5, zorder=3)
        ax.plot(outside, place, "D", color=VERMILION, alpha=look, markersize=5, zorder=3)
    for marker, colour, label in (
        ("o", BLUE, "in sample"),
        ("D", VERMILION, "rows left out in turn"),
    ):
        ax.plot([], [], marker, color=colour, label=label)
    ax.plot(
        [], [], color=MUTED, linestyle=(0, (4, 3)),
        label=f"torque law of three terms, left out: {TORQUE_LAW_DEG:g} deg",
    )  # fmt: skip
    ax.set_xscale("log")
    ax.xaxis.set_major_locator(FixedLocator(_TICKS))
    ax.xaxis.set_major_formatter(ScalarFormatter())
    ax.xaxis.set_minor_locator(NullLocator())
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.set_yticks(range(len(ordered)), [str(rung["name"]) for rung in ordered])
    for label, rung in zip(ax.get_yticklabels(), ordered, strict=True):
        label.set_color("black" if rung["climbed"] else MUTED)
    ax.invert_yaxis()
    ax.grid(False, axis="y")
    figure.legend(loc="outside upper right", ncols=3)
    return figure
