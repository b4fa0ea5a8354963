"""Figures of tables at rest and of a loop beside their simulations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pamsim.report.numbers import fixed, words
from pamsim.report.style import RULE, finish_axes, new_figure, styled
from pamsim.scene.series_colours import BLUE, GREEN, INK, MUTED, VERMILION

_FAR = 1.5  # of the root mean square: rows beyond it are named
_BAR = 22.0  # width [kPa]
_DASHED = (0, (4, 3))


@styled
def row_errors(result: Mapping[str, Any]) -> Figure:
    """Errors of rows over the pressure that all muscles share, before and after a diagnosis."""
    states = [("before_deg", VERMILION, "rig, nuisance parameters refitted")]
    if result["effects"]:
        states.append(("after_deg", BLUE, "with the effects that were found"))
    figure, axes = new_figure(2.2 * len(states), rows=len(states), sharey=True)
    for ax, state in zip(axes, states, strict=True):
        _rows(ax, result["rows"], *state)
    axes[-1].set_xlabel("lower pressure of the row [kPa]")
    return figure


@styled
def loop_branches(result: Mapping[str, Any]) -> Figure:
    """The loop that was diagnosed, and the difference of its branches with what was found."""
    figure, (loop, apart) = new_figure(5.6, rows=2, sharex=True, height_ratios=(1.25, 1.0))
    branches = result["branches"]
    pressure, opened, error = (branches[key] for key in ("pressure_kpa", "opened_mm", "error_mm"))
    rising, falling = (np.array(branches[f"{word}_mm"]) for word in ("rising", "falling"))
    middle = 0.5 * (rising + falling)
    base = {"color": MUTED, "linestyle": _DASHED, "label": "reversible curve"}
    loop.plot(pressure, middle, **base)
    shown: list[Any] = [
        apart.bar(
            pressure, rising - falling, width=_BAR, color=RULE, zorder=2, yerr=error,
            error_kw={"ecolor": INK, "elinewidth": 0.9, "capsize": 2.5},
            label="readings" if error is None else "readings ± standard error",
        ),
        apart.axhline(0.0, zorder=3, **base),
    ]  # fmt: skip
    sides = (("rising", rising, 0.5, BLUE, "^"), ("falling", falling, -0.5, VERMILION, "v"))
    for word, read, half, colour, marker in sides:
        loop.plot(pressure, read, marker, color=colour, markersize=5, label=f"readings, {word}")
        if opened is not None:
            loop.plot(pressure, middle + half * np.array(opened), color=colour, linewidth=1.1)
    if opened is not None:
        name = " + ".join(words(one["effect"]) for one in result["effects"])
        loop.plot([], [], color=INK, linewidth=1.1, label=name)
        shown += apart.plot(
            pressure, opened, "D-", color=GREEN, markersize=4, linewidth=1.1, label=name
        )
    finish_axes(loop, y="length [mm]", zero=False)
    loop.legend(loc="upper right")
    finish_axes(
        apart, x="gauge pressure [kPa]", y="rising − falling [mm]",
        title="difference of the branches", zero=False,
    )  # fmt: skip
    apart.use_sticky_edges = False  # or the line at zero would lie on the frame
    apart.margins(y=0.06)
    apart.legend(handles=shown, loc="upper right")
    return figure


def _rows(ax: Axes, rows: list[Mapping[str, Any]], key: str, colour: str, title: str) -> None:
    common = np.array([min(row["pressure_kpa"]) for row in rows])
    off = np.array([row[key] for row in rows])
    ax.plot(common, off, "o", color=colour, markersize=4.5, zorder=3)
    rms = float(np.sqrt(np.mean(off**2)))
    # Rows without common pressure lie on one another; names of neighbours go up and down in turn.
    far = np.flatnonzero((np.abs(off) > _FAR * rms) & (common > 0.0))
    for turn, i in enumerate(far[np.argsort(common[far], kind="stable")]):
        ax.annotate(
            rows[i]["row"], (common[i], off[i]), xytext=(5, 2), textcoords="offset points",
            fontsize=8, color=MUTED, va="top" if turn % 2 else "bottom",
        )  # fmt: skip
    finish_axes(ax, y="simulated − measured [deg]", title=f"{title}: {fixed(rms, 2)} deg RMS")


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
