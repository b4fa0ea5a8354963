"""The map of local models: how gain, time constants and dead time change with the level."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pamsim.report.identify_figures import label
from pamsim.report.numbers import fixed
from pamsim.report.style import INK, finish_axes, new_figure, series_look, styled

_DIRECTIONS = {1: ("^", "rising input"), -1: ("v", "falling input"), 0: ("o", "both ways")}


@styled
def local_map(result: Mapping[str, Any]) -> Figure:
    """One panel per parameter against the pressure level, with 95 % intervals.

    The marker is that of the step's direction, the colour that of the load.
    """
    models = [m for m in result["local"]["models"] if m["status"] == "converged"]
    names = list(dict.fromkeys(name for m in result["local"]["models"] for name in m["parameters"]))
    figure, panels = new_figure(0.7 + 1.9 * len(names), rows=len(names), sharex=True)
    loads = sorted({model["load_kg"] for model in models})
    levels = [model["pressure_kpa"] for model in models]
    # Steps at one level would be drawn on top of each other.
    by_level = len(set(levels)) > 1
    places = levels if by_level else [float(i) for i in range(1, len(models) + 1)]
    for ax, name in zip(panels, names, strict=True):
        _panel(ax, models, places, name, loads)
    panels[-1].set_xlabel(
        "mean gauge pressure of the muscles [kPa]"
        if by_level
        else f"operating point, all at {fixed(levels[0] if levels else None, 0)} kPa"
    )
    _legend(figure, models, loads)
    return figure


def _panel(
    ax: Axes,
    models: Sequence[Mapping[str, Any]],
    places: Sequence[float],
    name: str,
    loads: list[float],
) -> None:
    unit = ""
    for model, place in zip(models, places, strict=True):
        item = model["parameters"][name]
        unit = item["unit"]
        colour, _ = series_look(loads.index(model["load_kg"]))
        marker, _ = _DIRECTIONS[model["direction"]]
        value, sides = item["value"], item["interval95"]
        if value is None:
            continue
        if sides is not None and None not in sides:
            ax.vlines(place, sides[0], sides[1], color=colour, linewidth=1.0)
        ax.plot(place, value, marker, color=colour, markersize=5)
    finish_axes(ax, y=label(name, unit), zero=False)
    values = [m["parameters"][name]["value"] for m in models]
    if values and all(value is not None for value in values):
        # A very wide interval must not compress the scale of all values.
        low, high = float(np.min(values)), float(np.max(values))
        margin = max(high - low, 0.5 * abs(high))
        bottom, top = ax.get_ylim()
        ax.set_ylim(max(bottom, low - margin), min(top, high + margin))


def _legend(figure: Figure, models: Sequence[Mapping[str, Any]], loads: list[float]) -> None:
    handles = [
        Line2D([], [], color=series_look(i)[0], linewidth=3, label=f"load {load:g} kg")
        for i, load in enumerate(loads)
    ]
    for direction, (marker, text) in _DIRECTIONS.items():
        if any(model["direction"] == direction for model in models):
            handles.append(Line2D([], [], color=INK, marker=marker, linestyle="none", label=text))
    if handles:
        figure.legend(handles=handles, loc="outside upper right", ncols=min(len(handles), 4))
