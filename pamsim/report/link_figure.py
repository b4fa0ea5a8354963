"""Figure of where a gap is born: a pair of bars for every link of the chain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from pamsim.report.numbers import significant
from pamsim.report.style import BLUE, GREEN, INK, VERMILION, finish_axes, new_figure, styled

_BAR = 0.36  # width; links are 1 apart
_BELOW = 0.7  # of the noise, where bars begin: those that reach it are still seen


@styled
def link_bars(links: Sequence[Mapping[str, Any]], *, repaired: bool) -> Figure:
    """Held-out misfit of every link over its noise, before and after, from the command on.

    Args:
        links: of a result of schema ``pamsim-diagnosis/3``.
        repaired: whether effects were found.
    """
    figure, (ax,) = new_figure(2.9)
    states = [("before", VERMILION), ("after", BLUE)] if repaired else [("before", GREEN)]
    if not repaired and any(one["more_left"] for one in links):
        states = [("before", VERMILION)]
    most = 2.0
    for place, one in enumerate(links):
        for number, (state, colour) in enumerate(states):
            if one[state] is None:  # its simulation breaks down
                continue
            at = place + (number - 0.5 * (len(states) - 1)) * _BAR
            value = max(one[state], _BELOW)
            most = max(most, value)
            ax.bar(at, value - _BELOW, width=0.94 * _BAR, bottom=_BELOW, color=colour)
            ax.annotate(
                significant(one[state], 3), (at, value), (0, 2), textcoords="offset points",
                ha="center", va="bottom", fontsize=8.5,
            )  # fmt: skip
    ax.axhline(1.0, color=INK, linewidth=1.2)
    ax.set_yscale("log")
    ax.set_ylim(_BELOW, most**1.15 * 1.1)
    ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    ax.yaxis.set_minor_locator(NullLocator())
    labels = [f"{one['link']}\n{' → '.join(one['signals'])}" for one in links]
    ax.set_xticks(range(len(links)), labels)
    ax.set_xlim(-0.7, len(links) - 0.3)
    finish_axes(ax, y="misfit / noise (mean squares)", zero=False)
    ax.tick_params(axis="x", length=0)
    for state, colour in states:
        label = state if repaired else "simulated"
        ax.plot([], [], color=colour, linewidth=5, label=label)
    ax.plot([], [], color=INK, linewidth=1.2, label="noise")
    figure.legend(loc="outside upper right", ncols=3)
    return figure
