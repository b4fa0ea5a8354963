"""What the window plots beside the arm: joints and pressures over time, and the loop they draw."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.recordings.signals import KINDS, SignalNames
from pamsim.scene.series_colours import INK, Rgb, rgb, series_rgb

COLUMN = 0.3
"""Share of the window's width that the plots take."""
_WHITE, _INK, _GRID = (1.0, 1.0, 1.0, 0.92), (0.12, 0.14, 0.17), (0.84, 0.86, 0.88)
_DARK = (0.1, 0.11, 0.13, 0.8)  # the engine gives the legend's letters a dark rim
_LINE = 0.15  # of the legend, as a share of the curves' height
SPAN = 10.0
"""Length of the curves over time [s]."""
_KEPT = 1000
"""Samples kept, which is also the most that the window's curves can hold."""
_INTERVAL = 0.03
"""Least time between two samples [s]: the loop shows the last 30 s or more."""


@dataclass(frozen=True, kw_only=True)
class Curve:
    """A curve in the units shown.

    Attributes:
        name: for the legend, with the present value; none if empty.
        colour: 0 to 1 each.
        points: (n, 2) across and up.
    """

    name: str
    colour: Rgb
    points: NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Plot:
    """Curves in one frame.

    Attributes:
        title: what goes up, with its unit.
        across: what goes to the right, with its unit.
        curves: in the order drawn.
        across_range: ends of the axis; those of the curves if None.
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
        samples = np.array(self._samples)
        kinds = [KINDS[kind] for kind in self._names.joints.values()]
        joints = samples[:, 1 : 1 + len(kinds)] * [kind.scale for kind in kinds]
        pressures = samples[:, 1 + len(kinds) :] * KINDS["pressure"].scale
        time = samples[:, 0]
        recent = time >= time[-1] - SPAN
        window = float(max(time[-1] - SPAN, 0.0)), float(max(time[-1], SPAN))

        def over_time(title: str, curves: Sequence[Curve]) -> Plot:
            return Plot(title=title, across="time [s]", curves=tuple(curves), across_range=window)

        alone = len(kinds) == 1
        now = [
            f"{_words(name)} {value:.1f} {kind.shown}"
            for name, value, kind in zip(self._names.joints, joints[-1], kinds, strict=True)
        ]
        turning = [
            Curve(
                name="" if alone else label,
                colour=rgb(INK) if alone else series_rgb(index),
                points=np.column_stack([time, joints[:, index]])[recent],
            )
            for index, label in enumerate(now)
        ]
        filled = [
            Curve(
                name=f"{_words(name)} {pressures[-1, index]:.0f} kPa",
                colour=series_rgb(index),
                points=np.column_stack([time, pressures[:, index]])[recent],
            )
            for index, name in enumerate(self._names.muscles)
            if np.isfinite(pressures[-1, index])
        ]
        units = " or ".join(dict.fromkeys(kind.shown for kind in kinds))
        plots = [
            over_time(now[0] if alone else f"joints [{units}]", turning),
            over_time("pressure [kPa]", filled),
        ]
        first, second = self._names.muscles[0], self._names.muscles[1:2]
        driving = pressures[:, 0] - pressures[:, 1] if second else pressures[:, 0]
        if np.isfinite(driving).all():
            loop = np.column_stack([driving, joints[:, 0]])
            curve = Curve(name="", colour=rgb(INK), points=loop)
            joint = _words(next(iter(self._names.joints)))
            across = " - ".join(map(_words, (first, *second)))
            plots.append(
                Plot(
                    title=f"{joint} [{kinds[0].shown}] over pressure",
                    across=f"{across} [kPa]",
                    curves=(curve,),
                )
            )
        return tuple(plots)


def _words(name: str) -> str:
    return name.replace("_", " ")


def figures(
    plots: Sequence[Plot], viewport: mujoco.MjrRect
) -> list[tuple[mujoco.MjrRect, mujoco.MjvFigure]]:
    """The plots one below the other at the left edge of a window, as MuJoCo draws them."""
    width, height = int(COLUMN * viewport.width), viewport.height // max(len(plots), 1)
    return [
        (
            mujoco.MjrRect(
                viewport.left, viewport.bottom + (len(plots) - 1 - row) * height, width, height
            ),
            _figure(plot),
        )
        for row, plot in enumerate(plots)
    ]


def _figure(plot: Plot) -> mujoco.MjvFigure:
    figure = mujoco.MjvFigure()
    mujoco.mjv_defaultFigure(figure)
    figure.title, figure.xlabel = plot.title, plot.across
    figure.figurergba, figure.panergba, figure.legendrgba = _WHITE, _WHITE, _DARK
    figure.textrgb, figure.gridrgb = _INK, _GRID
    figure.gridsize, figure.linewidth = (6 if plot.across_range else 4, 5), 2.0
    named = sum(bool(curve.name) for curve in plot.curves)
    figure.flg_legend = int(named > 0)
    figure.xformat, figure.yformat = "%.0f", "%.0f"
    if plot.across_range is not None:
        figure.range[0] = plot.across_range
    figure.range[1] = 1.0, 0.0  # from the curves
    if named:  # with room for the legend above them
        values = np.concatenate([curve.points[:, 1] for curve in plot.curves])
        low, high = min(values.min(), 0.0), max(values.max(), 1.0)
        figure.range[1] = low, high + (0.1 + _LINE * named) * (high - low)
    for index, curve in enumerate(plot.curves):
        count = len(curve.points)
        figure.linepnt[index] = count
        figure.linergb[index] = curve.colour
        figure.linename[index] = curve.name
        figure.linedata[index, : 2 * count] = curve.points.ravel()
    return figure
