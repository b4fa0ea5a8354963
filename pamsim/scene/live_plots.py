"""What the window plots beside the arm: joints and pressures over time, and the loop they draw."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.recordings.signals import KINDS, SignalNames
from pamsim.scene.series_colours import INK, Rgb, rgb, series_rgb

COLUMN = 0.3
"""Share of the window's width that the plots take."""
SPAN = 10.0
"""Length of the curves over time [s]."""
_WHITE, _INK, _GRID = (1.0, 1.0, 1.0, 0.92), (0.12, 0.14, 0.17), (0.84, 0.86, 0.88)
_DARK = (0.1, 0.11, 0.13, 0.8)  # the engine gives the legend's letters a dark rim
_LINE = 0.15  # of the legend, as a share of the curves' height
_KEPT = 1000
"""Samples kept, which is also the most that the window's curves can hold."""
_INTERVAL = 0.03
"""Least time between two samples [s]: the loop shows the last 30 s or more."""


class Curve(NamedTuple):
    """Points (n, 2), across and up, in the units shown; without a name it has no legend."""

    name: str
    colour: Rgb
    points: NDArray[np.float64]


class Plot(NamedTuple):
    """Curves in one frame: what goes up and across, and the ends of the axis across.

    Without ends the axis is as long as the curves.
    """

    title: str
    across: str
    curves: tuple[Curve, ...]
    across_range: tuple[float, float] | None = None


class LivePlots:
    """Keeps the last samples of a moving rig and plots them.

    Args:
        names: of the rig's joints and muscles.
    """

    def __init__(self, names: SignalNames) -> None:
        self._names = names
        self._samples: deque[NDArray[np.float64]] = deque(maxlen=_KEPT)

    def add(self, time: float, positions: Sequence[float], pressures: Sequence[float]) -> None:
        """Take a sample; an earlier time than the last starts over.

        Args:
            time: [s].
            positions: of the joints [rad or m].
            pressures: gauge pressures of the muscles [Pa], NaN where not known.
        """
        since = time - self._samples[-1][0] if self._samples else _INTERVAL
        if since < 0.0:
            self._samples.clear()
        elif since < _INTERVAL:
            return
        self._samples.append(np.array([time, *positions, *pressures]))

    def plots(self) -> tuple[Plot, ...]:
        """Joints over time, pressures over time, the first joint over what drives it."""
        kinds = [KINDS[kind] for kind in self._names.joints.values()]
        joints, muscles = (
            [_words(n) for n in names] for names in (self._names.joints, self._names.muscles)
        )
        count, alone = len(joints), len(joints) == 1
        scales = [kind.scale for kind in kinds] + [KINDS["pressure"].scale] * len(muscles)
        time, *values = (np.array(self._samples) * [1.0, *scales]).T
        recent = time >= time[-1] - SPAN
        window = float(max(time[-1] - SPAN, 0.0)), float(max(time[-1], SPAN))

        def over_time(index: int, label: str, colour: Rgb) -> Curve:
            return Curve(label, colour, np.column_stack([time, values[index]])[recent])

        now = [
            f"{name} {value[-1]:.1f} {kind.shown}"
            for name, value, kind in zip(joints, values, kinds, strict=False)
        ]
        turning = [
            over_time(k, "" if alone else label, rgb(INK) if alone else series_rgb(k))
            for k, label in enumerate(now)
        ]
        filled = [
            over_time(count + k, f"{name} {values[count + k][-1]:.0f} kPa", series_rgb(k))
            for k, name in enumerate(muscles)
            if np.isfinite(values[count + k][-1])
        ]
        units = " or ".join(dict.fromkeys(kind.shown for kind in kinds))
        title = now[0] if alone else f"joints [{units}]"
        plots = [
            Plot(title, "time [s]", tuple(turning), window),
            Plot("pressure [kPa]", "time [s]", tuple(filled), window),
        ]
        pair = muscles[:2]
        driving = values[count] - values[count + 1] if pair[1:] else values[count]
        if np.isfinite(driving).all():
            loop = Curve("", rgb(INK), np.column_stack([driving, values[0]]))
            title, across = f"{joints[0]} [{kinds[0].shown}] over pressure", " - ".join(pair)
            plots.append(Plot(title, f"{across} [kPa]", (loop,)))
        return tuple(plots)


def _words(name: str) -> str:
    return name.replace("_", " ")


def figures(
    plots: Sequence[Plot], viewport: mujoco.MjrRect
) -> list[tuple[mujoco.MjrRect, mujoco.MjvFigure]]:
    """The plots one below the other at the left edge of a window, as MuJoCo draws them."""
    width, height = int(COLUMN * viewport.width), viewport.height // max(len(plots), 1)
    bottoms = [viewport.bottom + row * height for row in range(len(plots))][::-1]
    return [
        (mujoco.MjrRect(viewport.left, bottom, width, height), _figure(plot))
        for bottom, plot in zip(bottoms, plots, strict=True)
    ]


def _figure(plot: Plot) -> mujoco.MjvFigure:
    figure = mujoco.MjvFigure()
    mujoco.mjv_defaultFigure(figure)
    figure.title, figure.xlabel = plot.title, plot.across
    figure.figurergba, figure.panergba, figure.legendrgba = _WHITE, _WHITE, _DARK
    figure.textrgb, figure.gridrgb = _INK, _GRID
    figure.gridsize, figure.linewidth = (6 if plot.across_range else 4, 5), 2.0
    figure.xformat, figure.yformat = "%.0f", "%.0f"
    if plot.across_range is not None:
        figure.range[0] = plot.across_range
    named = sum(bool(curve.name) for curve in plot.curves)
    figure.flg_legend = int(named > 0)
    figure.range[1] = 1.0, 0.0  # from the curves
    if named:  # with room for the legend above them
        values = np.concatenate([curve.points[:, 1] for curve in plot.curves])
        low, high = min(values.min(), 0.0), max(values.max(), 1.0)
        figure.range[1] = low, high + (0.1 + _LINE * named) * (high - low)
    for index, curve in enumerate(plot.curves):
        figure.linename[index], figure.linergb[index] = curve.name, curve.colour
        figure.linepnt[index] = len(curve.points)
        figure.linedata[index, : curve.points.size] = curve.points.ravel()
    return figure
