"""Figures of where a gap is born, and of the curves that stand for what has no name.

What they draw is of a result of schema ``pamsim-diagnosis/3``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from pamsim.report.numbers import significant
from pamsim.report.style import BLUE, GREEN, INK, VERMILION, finish_axes, new_figure, styled

_WIDTH_IN = 5.2  # a phone shows it at two thirds, where it can still be read
_BAR = 0.36  # thickness; links are 1 apart
_CURVE_IN = 2.4  # height of a curve's axes
_BELOW = 0.7  # of the noise, where bars begin: those that reach it are still seen


@styled
def learned_curves(learned: Sequence[Mapping[str, Any]]) -> Figure:
    """Learned torques over position or speed, one below the other."""
    figure, axes = new_figure(_CURVE_IN * len(learned), len(learned), 1, width_in=_WIDTH_IN)
    for ax, one in zip(axes, learned, strict=True):
        ax.plot(one["at"], one["torque"], color=BLUE)
        unit = one["torque_unit"].replace("*", " ")
        finish_axes(ax, x=f"{one['joint']} [{one['at_unit']}]", y=f"learned [{unit}]")
    return figure


@styled
def link_bars(links: Sequence[Mapping[str, Any]], *, repaired: bool) -> Figure:
    """Held-out misfit of every link over its noise, from the command down.

    It is that before, and where effects were found (``repaired``) that after.
    """
    figure, (ax,) = new_figure(0.9 + 0.55 * len(links), width_in=_WIDTH_IN)
    states = [("before", VERMILION), ("after", BLUE)] if repaired else [("before", GREEN)]
    if not repaired and any(one["more_left"] is not False for one in links):
        states = [("before", VERMILION)]
    most = 2.0
    for place, one in enumerate(links):
        for number, (state, colour) in enumerate(states):
            if one[state] is None:  # its simulation breaks down
                continue
            at = place + (number - 0.5 * (len(states) - 1)) * _BAR
            value = max(one[state], _BELOW)
            most = max(most, value)
            ax.barh(at, value - _BELOW, height=0.94 * _BAR, left=_BELOW, color=colour)
            ax.annotate(
                significant(one[state], 3), (max(value, 1.0), at), (3, 0),
                textcoords="offset points", ha="left", va="center", fontsize=8.5,
            )  # fmt: skip
    ax.axvline(1.0, color=INK, linewidth=1.2)
    ax.set_xscale("log")
    ax.set_xlim(_BELOW, most**1.15 * 1.2)
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    ax.xaxis.set_minor_locator(NullLocator())
    labels = [f"{one['link']}\n{' → '.join(one['signals'])}" for one in links]
    ax.set_yticks(range(len(links)), labels)
    ax.set_ylim(len(links) - 0.4, -0.6)
    finish_axes(ax, x="misfit / noise (mean squares)", zero=False)
    ax.grid(False, axis="y")
    ax.grid(True, axis="x")
    ax.tick_params(axis="y", length=0)
    for state, colour in states:
        label = state if repaired else "simulated"
        ax.plot([], [], color=colour, linewidth=5, label=label)
    ax.plot([], [], color=INK, linewidth=1.2, label="noise")
    figure.legend(loc="outside upper right", ncols=3)
    return figure
