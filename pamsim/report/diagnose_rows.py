"""Figures of a table at rest and of a loop: the errors before and after the repair."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pamsim.report.numbers import fixed, p_is, words
from pamsim.report.style import (
    BLUE,
    GREEN,
    INK,
    MUTED,
    RULE,
    VERMILION,
    finish_axes,
    new_figure,
    say_empty,
    styled,
)

_BEST_TRIED = 6
_FAR = 1.5  # of the root mean square: rows beyond it are named
_BAR = 22.0  # width [kPa]
_DASHED = (0, (4, 3))


@styled
def row_errors(result: Mapping[str, Any]) -> Figure:
    """Three panels: rows over common pressure, before and after, and the errors of all models.

    Args:
        result: of a table at rest.
    """
    figure, (before, after, errors) = new_figure(
        6.6, rows=3, height_ratios=(1.0, 1.0, 1.0), sharex=False
    )
    _rows(before, result, "before_deg", VERMILION, "base model, refitted")
    _rows(after, result, "after_deg", BLUE, "with the best effects")
    if result["rows"][0]["after_deg"] is not None:
        limit = 1.15 * max(abs(row["before_deg"]) for row in result["rows"])
        for ax in (before, after):
            ax.set_ylim(-limit, limit)
    _errors(errors, result)
    return figure


@styled
def loop_branches(result: Mapping[str, Any]) -> Figure:
    """Two panels: the loop, and the difference of its branches.

    Both show the readings, the reversible curve, and the model that predicts unseen readings best,
    whether or not it may be claimed.

    Args:
        result: of a loop.
    """
    figure, (loop, apart) = new_figure(5.6, rows=2, sharex=True, height_ratios=(1.25, 1.0))
    (place,) = result["where"]
    branches, nearest = result["branches"], result["branches"]["nearest"]
    pressure = branches["pressure_kpa"]
    base = {"color": MUTED, "linestyle": _DASHED, "label": "reversible curve"}
    loop.plot(pressure, branches["reversible_mm"], **base)
    error = branches["error_mm"]
    measured = apart.bar(
        pressure, branches["rising_minus_falling_mm"], width=_BAR, color=RULE, zorder=2,
        yerr=error, error_kw={"ecolor": INK, "elinewidth": 0.9, "capsize": 2.5},
        label="readings" if error is None else "readings ± standard error",
    )  # fmt: skip
    shown: list[Any] = [measured, apart.axhline(0.0, zorder=3, **base)]
    for word, colour, marker in (("rising", BLUE, "^"), ("falling", VERMILION, "v")):
        loop.plot(pressure, branches[f"{word}_mm"], marker, color=colour, markersize=5,
                  label=f"readings, {word}")  # fmt: skip
        if nearest is not None:
            loop.plot(pressure, nearest[f"{word}_mm"], color=colour, linewidth=1.1)
    if nearest is not None:
        name = f"{words(nearest['effect'])} ({words(nearest['form'])})"
        name += "" if result["alternatives"] or result["effects"] else ", not claimed"
        loop.plot([], [], color=INK, linewidth=1.1, label=name)
        modelled = np.subtract(nearest["rising_mm"], nearest["falling_mm"])
        shown += apart.plot(
            pressure, modelled, "D-", color=GREEN, markersize=4, linewidth=1.1, label=name
        )
    finish_axes(loop, y="length [mm]", zero=False)
    loop.legend(loc="upper right")
    finish_axes(
        apart, x="gauge pressure [kPa]", y="rising − falling [mm]",
        title=f"difference of the branches, {p_is(place['p_value'])}", zero=False,
    )  # fmt: skip
    apart.use_sticky_edges = False  # or the line at zero would lie on the frame
    apart.margins(y=0.06)
    apart.legend(handles=shown, loc="upper right")
    return figure


def _rows(ax: Axes, result: Mapping[str, Any], key: str, colour: str, title: str) -> None:
    rows = [row for row in result["rows"] if row[key] is not None]
    if not rows:
        say_empty(ax, "no effect improves the prediction")
        return
    names = [name for name in rows[0] if name.startswith("p") and name.endswith("_kpa")]
    common = np.array([min(row[name] for name in names) for row in rows])
    off = np.array([row[key] for row in rows])
    ax.plot(common, off, "o", color=colour, markersize=4.5, zorder=3)
    rms = float(np.sqrt(np.mean(off**2)))
    for i in np.flatnonzero(np.abs(off) > _FAR * rms):
        if common[i] > 0.0:  # rows without common pressure lie on one another
            ax.annotate(
                rows[i]["row"], (common[i], off[i]), xytext=(5, -3), textcoords="offset points",
                fontsize=8, color=MUTED,
            )  # fmt: skip
    finish_axes(
        ax, x="lower pressure of the row [kPa]", y="simulated − measured [deg]",
        title=f"{title}: {fixed(rms, 2)} deg RMS at held-out rows",
    )  # fmt: skip


def _errors(ax: Axes, result: Mapping[str, Any]) -> None:
    gap = next(iter(result["gap"].values()))
    shown: list[tuple[str, float, str]] = [
        ("as it stands", gap["as_it_stands"]["value"], MUTED),
        ("refitted", gap["before"]["value"], VERMILION),
    ]
    single = [t for t in result["tried"] if len(t["effects"]) == 1][:_BEST_TRIED]
    shown += [
        (f"+ {words(t['effects'][0])}", t["held_out"], GREEN if t["accepted"] else MUTED)
        for t in single
    ]
    if gap["after"]:
        best = words(result["resembles"]["name"]).replace("+", " + ")
        shown.append((best, gap["after"]["value"], BLUE))
    places = np.arange(len(shown))
    ax.barh(places, [value for _, value, _ in shown], color=[c for _, _, c in shown], height=0.65)
    for place, (_, value, _) in enumerate(shown):
        ax.annotate(
            fixed(value, 2), (value, place), xytext=(4, 0), textcoords="offset points",
            va="center", fontsize=8, color=INK,
        )  # fmt: skip
    ax.set_yticks(places, [name for name, _, _ in shown], fontsize=8)
    ax.invert_yaxis()
    finish_axes(ax, x="RMS error at held-out rows [deg]", zero=False)
    ax.grid(False, axis="y")
