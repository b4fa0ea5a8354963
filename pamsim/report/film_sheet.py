"""What all frames of a film share: the signals below the arms, titles and the muscles' names.

It is drawn once by matplotlib; a frame only puts the arms into it and paints the cursors.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from pamsim.comparison.compared_signal import Comparison, shown_unit
from pamsim.core.errors import InputError
from pamsim.core.units import PA_PER_KPA, FloatArray
from pamsim.recordings.signals import JOINT_KINDS, kind_of
from pamsim.recordings.trial import Trial
from pamsim.report.numbers import fixed, words
from pamsim.report.style import BLUE, INK, MUTED, VERMILION, finish_axes, series_look, styled

Picture = NDArray[np.uint8]

SMALLEST = 400, 320
"""Width and height below which labels run into each other [px]."""

_PANEL_SHARE = 1 / 3
_SLIVER = 0.01  # px
_WIDTH_IN = 8.0  # at any number of pixels, so that letters keep their share of the width
_ABOVE, _BELOW = 0.045, -0.075
"""From a muscle's fixed end up to its label, in heights of the arm's picture."""
_WITHIN = 0.03
"""From the fixed end of one of many muscles to its label, which lies on it, in widths."""

ARM = 320, 172
"""Width and height of each arm of a gap [px]."""
_TITLE, _CURVES = 26, 150  # height of the titles above the arms and of the curves below [px]
_GAP_DPI = 100.0


class Curve(NamedTuple):
    """A curve as painted: colour and, for each column of its plot, the row it passes."""

    colour: NDArray[np.uint8]
    rows: FloatArray


class Plot(NamedTuple):
    """A plot as painted; columns and rows count from the picture's upper left corner [px]."""

    left: float
    right: float
    top: int
    bottom: int
    curves: tuple[Curve, ...]

    def column(self, share: float) -> int:
        """Column of the cursor when a share of the time has gone by."""
        return round(self.left + min(max(share, 0.0), 1.0) * (self.right - self.left))

    def paint_cursor(self, picture: Picture, share: float) -> None:
        """Paint the cursor, with a dot on each curve, into the picture that has the plot."""
        size = max(1, round(picture.shape[1] / 400))
        column = self.column(share)
        picture[self.top : self.bottom, column : column + size] = _colour(INK)
        for colour, rows in self.curves:
            _dot(picture, column + size / 2, float(rows[column]), 2.2 * size, colour)


class FilmSheet(NamedTuple):
    """What all frames of a film share.

    Attributes:
        duration: of the trial [s].
        picture: (height, width, 3) a frame without arms and cursors.
        above: rows of it above the arms.
        ink: (arm height, width, 4) what is written over the arms, in 0 to 255.
        plots: where the cursors go.
    """

    duration: float
    picture: Picture
    above: int
    ink: NDArray[np.float32]
    plots: tuple[Plot, ...]

    def frame(self, arms: Picture, time: float) -> Picture:
        """A frame (height, width, 3) from a picture of the arms at a time [s]."""
        frame, cover = self.picture.copy(), self.ink[..., 3:] / np.float32(255.0)
        written = arms + (self.ink[..., :3] - arms) * cover
        frame[self.above : self.above + len(arms)] = np.round(written).astype(np.uint8)
        for plot in self.plots:
            plot.paint_cursor(frame, time / self.duration)
        return frame


def arm_size(width: int, height: int) -> tuple[int, int]:
    """Width and height left for the arm in a frame [px]; an `InputError` if it is too small."""
    if width < SMALLEST[0] or height < SMALLEST[1]:
        raise InputError(
            f"{width} x {height} pixels are too small for arm and plots; give a `width`"
            f" of {SMALLEST[0]} and a `height` of {SMALLEST[1]} or more"
        )
    return width, height - round(_PANEL_SHARE * height)


@styled
def film_sheet(
    trial: Trial,
    *,
    size: tuple[int, int],
    labels: Mapping[str, tuple[float, float]],
    title: str,
) -> FilmSheet:
    """Draw what all frames of a film of a trial share.

    Args:
        trial: with a measured angle; pressures that were not measured are left out and said so.
        size: width and height of a frame [px].
        labels: name of each muscle -> column and row of its fixed end in the arm's picture [px].
        title: written above the arm.

    Raises:
        InputError: if the frame is too small for labels.
    """
    width, arm = arm_size(*size)
    figure = _figure(width, size[1] - arm)
    left, right = figure.subplots(1, 2)
    curves = {left: _joints(left, trial), right: _pressures(right, trial)}
    finish_axes(right, x="time [s]", y="gauge pressure [kPa]", zero=False)
    for ax in curves:
        ax.set_xlim(0.0, trial.time[-1])
        ax.margins(y=0.08)
    panel = _painted(figure)[..., :3]
    return FilmSheet(
        duration=float(trial.time[-1]),
        picture=np.concatenate([np.zeros((arm, width, 3), dtype=np.uint8), panel]),
        above=0,
        ink=_writing((width, arm), labels, title),
        plots=tuple(_painted_plot(ax, lines, below=arm) for ax, lines in curves.items()),
    )


def _joints(ax: Axes, trial: Trial) -> list[Line2D]:
    """Plot the measured joints; return their lines."""
    lines: list[Line2D] = []
    channels = [channel for channel in trial.measured if kind_of(channel) in JOINT_KINDS]
    for index, channel in enumerate(channels):
        unit, scale = shown_unit(channel)
        colour = series_look(index)[0] if len(channels) > 1 else INK
        label = f"{channel} [{unit}]"
        lines += ax.plot(trial.time, trial.measured[channel] * scale, color=colour, label=label)
    named = len(channels) > 1 or bool(trial.muscle_names)
    finish_axes(ax, x="time [s]", y="joint" if named else "angle β [deg]", zero=False)
    if named:
        ax.legend(loc="best")
    return lines


def _pressures(ax: Axes, trial: Trial) -> list[Line2D]:
    """Plot measured pressures, and set points if those were commanded; return the measured."""
    curves, missing = [], []
    for index, channel in enumerate(trial.pressure_channels):
        colour, _ = series_look(index)
        label = words(trial.muscle_names[index]) if trial.muscle_names else f"muscle {index + 1}"
        values = trial.measured.get(channel)
        if trial.drives.muscles[index] == "pressure_set":
            wanted = trial.command[:, index] / PA_PER_KPA
            look: dict[str, Any] = {"color": colour, "linestyle": ":", "linewidth": 1.1}
            ax.step(trial.time, wanted, where="post", **look)
        if values is None:
            missing.append(label)
            continue
        curves += ax.plot(trial.time, values / PA_PER_KPA, color=colour, label=label)
    handles = [*curves]
    if "pressure_set" in trial.drives.muscles:
        handles.append(Line2D([], [], color=MUTED, linestyle=":", label="set point"))
    if missing:
        handles.append(Line2D([], [], linestyle="", label=f"{', '.join(missing)}: not measured"))
    ax.legend(
        handles=handles,
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        ncols=len(handles) if trial.muscles <= 2 else -(-len(handles) // 2),
        borderaxespad=0.1,
        handlelength=1.4,
        columnspacing=1.1,
    )
    return curves


def _writing(
    size: tuple[int, int], labels: Mapping[str, tuple[float, float]], title: str
) -> NDArray[np.float32]:
    """Title and names of the muscles on nothing, (h, w, 4) in 0 to 255."""
    width, height = size
    figure = _figure(width, height)
    figure.patch.set_alpha(0.0)
    halo = [withStroke(linewidth=3.0, foreground="white")]
    figure.text(0.015, 1.0 - 9.0 / height * width / 400, title, va="top", size=10.5, color=INK)
    top = min((row for _, row in labels.values()), default=0.0)
    pair = len(labels) <= 2
    for index, (name, (column, row)) in enumerate(labels.items()):
        colour, _ = series_look(index)
        upper = row == top  # away from the other muscle
        across, up = (0.0, _ABOVE if upper else _BELOW) if pair else (_WITHIN, 0.0)
        figure.text(
            column / width + across,
            1.0 - row / height + up,
            words(name),
            ha="left",
            va=("bottom" if upper else "top") if pair else "center",
            color=colour,
            weight="bold",
            size=10.5,
            path_effects=halo,
        )
    return _painted(figure).astype(np.float32)


@styled
def gap_sheet(part: Comparison) -> tuple[FilmSheet, list[str]]:
    """What all frames of the film of a gap share, and the states that it shows."""
    before = "simulated" if part.after is None else "before the repair"
    titles = {"measured": ("measured", INK), "before": (before, VERMILION),
              "after": ("after it", BLUE)}  # fmt: skip
    states = [state for state in titles if getattr(part, state) is not None]
    width, height = len(states) * ARM[0], _TITLE + ARM[1] + _CURVES
    figure = Figure(figsize=(width / _GAP_DPI, height / _GAP_DPI), dpi=_GAP_DPI)
    FigureCanvasAgg(figure)
    left, bottom, right = 62 / width, 40 / height, 26 / width
    ax = figure.add_axes((left, bottom, 1.0 - left - right, (_CURVES - 50) / height))
    unit, scale = shown_unit(part.channel)
    for place, state in enumerate(states):
        values, (title, colour) = getattr(part, state), titles[state]
        width_pt, opacity = (3.5, 0.35) if state == "measured" else (1.5, 1.0)  # seen around others
        ax.plot(part.time, values * scale, color=colour, linewidth=width_pt, alpha=opacity)
        error = "" if state == "measured" else f": {fixed(part.rms(values), 2)} {unit} RMS"
        across = (place + 0.5) / len(states)
        figure.text(
            across, 1.0 - 5 / height, f"{title}{error}",
            color=colour, weight="bold", ha="center", va="top",
        )  # fmt: skip
    ax.set_xlim(part.time[0], part.time[-1])
    finish_axes(ax, x="time [s]", y=f"{words(part.channel)} [{unit}]", zero=False)
    picture = _painted(figure)[..., :3].copy()
    nothing = np.zeros((ARM[1], width, 4), dtype=np.float32)
    sheet = FilmSheet(float(part.time[-1]), picture, _TITLE, nothing, (_painted_plot(ax),))
    return sheet, states


def _figure(width: int, height: int) -> Figure:
    dpi = width / _WIDTH_IN
    # A little more: matplotlib before 3.11 cuts off, and 426.9999 would be 426 pixels.
    size = (width + _SLIVER) / dpi, (height + _SLIVER) / dpi
    figure = Figure(figsize=size, dpi=dpi, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _painted(figure: Figure) -> Picture:
    """The pixels (h, w, 4) of a figure."""
    canvas = figure.canvas
    assert isinstance(canvas, FigureCanvasAgg)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())


def _painted_plot(ax: Axes, lines: Sequence[Line2D] = (), below: int = 0) -> Plot:
    """Where a plot and its curves lie in a frame whose part below a row [px] is their figure."""
    box = ax.get_window_extent()
    _, height = ax.figure.canvas.get_width_height()
    height += below
    columns = np.arange(int(np.ceil(box.x1)) + 2)
    curves = []
    for line in lines:
        across, up = ax.transData.transform(line.get_xydata()).T
        rows = height - np.interp(columns, across, up)
        curves.append(Curve(_colour(str(line.get_color())), rows))
    top, bottom = round(height - box.y1), round(height - box.y0)
    return Plot(box.x0, box.x1, top, bottom, tuple(curves))


def _colour(name: str) -> NDArray[np.uint8]:
    return np.round(255.0 * np.array(to_rgb(name))).astype(np.uint8)


def _dot(
    picture: Picture, column: float, row: float, radius: float, colour: NDArray[np.uint8]
) -> None:
    """Paint a disc with a soft rim and a white ring around it, so that it shows on its curve."""
    reach = int(radius + 3.0)
    top, left = max(0, int(row) - reach), max(0, int(column) - reach)
    patch = picture[top : int(row) + reach + 1, left : int(column) + reach + 1]
    y, x = np.ogrid[top : top + patch.shape[0], left : left + patch.shape[1]]
    distance = np.hypot(x + 0.5 - column, y + 0.5 - row)[..., None]
    for size, paint in ((radius + 1.5, np.full(3, 255.0)), (radius, colour)):
        cover = np.clip(size + 0.5 - distance, 0.0, 1.0)
        patch[:] = np.round(patch + (paint - patch.astype(float)) * cover)
