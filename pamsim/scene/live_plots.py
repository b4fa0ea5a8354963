"""What the window plots beside the arm: joints and pressures over time, and the loop they draw."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import mujoco
import numpy as np

from pamsim.core.units import FloatArray
from pamsim.recordings.signals import KINDS, SignalNames
from pamsim.scene.series_colours import INK, Rgb, rgb, series_rgb

COLUMN = 0.3  # share of the window's width that the plots take
SPAN = 10.0  # length of the curves over time [s]
_WHITE, _INK, _GRID = (1.0, 1.0, 1.0, 0.92), (0.12, 0.14, 0.17), (0.84, 0.86, 0.88)
_LOOP = rgb(INK)
_DARK = (0.1, 0.11, 0.13, 0.8)  # the engine gives the legend's letters a dark rim
_LINE = 0.15  # of the legend, as a share of the curves' height
_KEPT = 1000  # samples, which is also the most that the window's curves can hold
_INTERVAL = 0.03  # least time between two samples [s]: the loop shows the last 30 s or more


class LivePlots:
    """Keeps the last samples of a moving rig, of the names of its joints and muscles, to plot."""

    def __init__(self, names: SignalNames) -> None:
        self._names = names
        self._samples: deque[FloatArray] = deque(maxlen=_KEPT)

    def add(self, time: float, positions: Sequence[float], pressures: Sequence[float]) -> None:
        """Take joint positions [rad or m] and gauge pressures [Pa] of a time [s].

        A time before the last starts over. A pressure that is not known is NaN.
        """
        since = time - self._samples[-1][0] if self._samples else _INTERVAL
        if since < 0.0:
            self._samples.clear()
        elif since < _INTERVAL:
            return
        self._samples.append(np.array([time, *positions, *pressures]))

    def figures(self) -> list[mujoco.MjvFigure]:
        """Joints over time, pressures over time, the first joint over what drives it."""
        joints = [name.replace("_", " ") for name in self._names.joints]
        muscles = [name.replace("_", " ") for name in self._names.muscles]
        kinds = [KINDS[kind] for kind in self._names.joints.values()]
        scales = [1.0, *(kind.scale for kind in kinds), *[KINDS["pressure"].scale] * len(muscles)]
        time, *values = (np.array(self._samples) * scales).T
        positions, pressures = values[: len(joints)], values[len(joints) :]
        recent = time >= time[-1] - SPAN
        window = max(time[-1] - SPAN, 0.0), max(time[-1], SPAN)

        present = [
            f"{name} {values[-1]:.1f} {kind.shown}"
            for name, values, kind in zip(joints, positions, kinds, strict=True)
        ]
        title = f"joints [{' or '.join(dict.fromkeys(kind.shown for kind in kinds))}]"
        moving = [
            (label, series_rgb(k), time[recent], values[recent])
            for k, (label, values) in enumerate(zip(present, positions, strict=True))
        ]
        if len(joints) == 1:
            title, moving = present[0], [("", _LOOP, *moving[0][2:])]
        filled = [
            (f"{name} {values[-1]:.0f} kPa", series_rgb(k), time[recent], values[recent])
            for k, (name, values) in enumerate(zip(muscles, pressures, strict=True))
            if np.isfinite(values[-1])
        ]
        found = [
            _figure(title, "time [s]", moving, window),
            _figure("pressure [kPa]", "time [s]", filled, window),
        ]
        driving = pressures[0] - pressures[1] if muscles[1:] else pressures[0]
        if np.isfinite(driving).all():
            title = f"{joints[0]} [{kinds[0].shown}] over pressure"
            loop = ("", _LOOP, driving, positions[0])
            found.append(_figure(title, f"{' - '.join(muscles[:2])} [kPa]", [loop]))
        return found


def placed(
    figures: Sequence[mujoco.MjvFigure], viewport: mujoco.MjrRect
) -> list[tuple[mujoco.MjrRect, mujoco.MjvFigure]]:
    """Figures one below the other at the left edge of a window."""
    width, height = int(COLUMN * viewport.width), viewport.height // max(len(figures), 1)
    bottoms = [viewport.bottom + row * height for row in range(len(figures))][::-1]
    return [
        (mujoco.MjrRect(viewport.left, bottom, width, height), figure)
        for bottom, figure in zip(bottoms, figures, strict=True)
    ]


def _figure(
    title: str,
    across: str,
    curves: Sequence[tuple[str, Rgb, FloatArray, FloatArray]],
    across_range: tuple[float, float] | None = None,
) -> mujoco.MjvFigure:
    """Curves (name, colour, values across and up); one without a name is not in the legend."""
    figure = mujoco.MjvFigure()
    mujoco.mjv_defaultFigure(figure)
    figure.title, figure.xlabel = title, across
    figure.figurergba, figure.panergba, figure.legendrgba = _WHITE, _WHITE, _DARK
    figure.textrgb, figure.gridrgb = _INK, _GRID
    figure.gridsize, figure.linewidth = (6 if across_range else 4, 5), 2.0
    figure.xformat, figure.yformat = "%.0f", "%.0f"
    if across_range is not None:
        figure.range[0] = across_range
    named = sum(bool(name) for name, *_ in curves)
    figure.flg_legend = int(named > 0)
    figure.range[1] = 1.0, 0.0  # from the curves
    if named:  # with room for the legend above them
        values = np.concatenate([up for *_, up in curves])
        low, high = min(values.min(), 0.0), max(values.max(), 1.0)
        figure.range[1] = low, high + (0.1 + _LINE * named) * (high - low)
    for index, (name, colour, *points) in enumerate(curves):
        figure.linename[index], figure.linergb[index] = name, colour
        figure.linepnt[index] = len(points[0])
        figure.linedata[index, : 2 * len(points[0])] = np.column_stack(points).ravel()
    return figure
