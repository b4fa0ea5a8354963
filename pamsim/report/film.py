"""Films and pictures of recorded trials: arms above, their signals below, a cursor at the time.

`film_trial` shows one arm as it was recorded, `film_gap` the arm as measured beside the arm as
simulated. Matplotlib paints what stands still once: a frame only puts the arms under the texts and
redraws the cursors.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from matplotlib.transforms import Bbox
from numpy.typing import NDArray

from pamsim.comparison.compared_signal import Comparison, shown_unit
from pamsim.core.computation import Progress
from pamsim.core.errors import InputError
from pamsim.engine.rig import Rig
from pamsim.recordings.pictures import check_film, write_film, write_picture
from pamsim.recordings.trial import Trial
from pamsim.report.numbers import fixed, words
from pamsim.report.step_figure import plot_joints, plot_pressures
from pamsim.report.style import finish_axes, series_look, styled
from pamsim.scene.replay import Replay, arm_camera, frame_times
from pamsim.scene.series_colours import BLUE, INK, VERMILION

Picture = NDArray[np.uint8]

_PALETTE_FRAMES = 5
_GAP_FPS = 12.0
_LONGEST = 4.0  # of the film of a gap [s]; a longer trial runs faster

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

_CURSOR: dict[str, Any] = {"color": INK, "linewidth": 1.4, "animated": True}  # 1/400 of the width
_DOT: dict[str, Any] = {"marker": "o", "markersize": 8.0, "markeredgecolor": "white"}
"""On a curve, from which its ring parts it."""


def film_trial(
    path: Path,
    replay: Replay,
    *,
    camera: str = "overview",
    size: tuple[int, int] = (800, 640),
    fps: float = 25.0,
    speed: float = 1.0,
    progress: Progress | None = None,
) -> None:
    """Write a film (.gif, .mp4) of a whole trial, seen by a camera of the rig's scene.

    The size is in pixels; at half the speed it is in slow motion.

    Raises:
        InputError: for an unknown camera or film format, a number out of range, a place that
            cannot be written.
        EngineError: if the arm cannot be drawn.
    """
    check_film(path, fps)
    times = frame_times(replay.duration, fps=fps, speed=speed).tolist()
    pace = f", at {speed:g} times its speed" if speed != 1.0 else ""
    with _trial_frames(replay, camera, size, replay.title + pace) as frame_at:
        some = times[:: max(1, len(times) // _PALETTE_FRAMES)]
        _write(path, frame_at, times, fps, some, progress)


def picture_instant(
    path: Path,
    replay: Replay,
    *,
    time: float,
    camera: str = "overview",
    size: tuple[int, int] = (1600, 1280),
) -> None:
    """Write a picture (.png, .jpg) of one instant [s] of a trial; see `film_trial`.

    Raises:
        InputError: as `film_trial`, and for a time outside the trial.
        EngineError: if the arm cannot be drawn.
    """
    if not 0.0 <= time <= replay.duration:
        raise InputError(
            f"`time` {time:g} s is not in trial {replay.trial.name!r}, which lasts"
            f" {replay.duration:g} s"
        )
    with _trial_frames(replay, camera, size, replay.title) as frame_at:
        write_picture(path, frame_at(time))


def film_gap(
    path: Path, rig: Rig, parts: Sequence[Comparison], *, progress: Progress | None = None
) -> None:
    """Write a film (.gif, .mp4) of one trial as measured, and as simulated before and after.

    The arms stand side by side, the curves of the first joint below. The rig was loaded with its
    scene; the parts are the compared channels of the trial.

    Raises:
        InputError: if a joint was not compared, or the place cannot be written.
        EngineError: if the arm cannot be drawn.
    """
    missing = set(rig.names.joint_channels) - {part.channel for part in parts}
    if missing:
        raise InputError(f"{path}: {', '.join(sorted(missing))} was not compared")
    (first,) = (part for part in parts if part.channel == rig.names.joint_channels[0])
    sheet, states = gap_sheet(first)
    replays = [Replay(rig=rig, trial=_as_trial(rig, parts, first, state)) for state in states]
    speed = max(sheet.duration / _LONGEST, 1.0)
    times = frame_times(sheet.duration, fps=_GAP_FPS, speed=speed).tolist()
    with contextlib.ExitStack() as stack:
        cameras = [
            stack.enter_context(arm_camera(each, width=ARM[0], height=ARM[1])) for each in replays
        ]

        def frame_at(time: float) -> Picture:
            return sheet.frame(np.hstack([camera.draw(time) for camera in cameras]), time)

        _write(path, frame_at, times, _GAP_FPS, (0.0, sheet.duration), progress)


def _write(
    path: Path,
    frame_at: Callable[[float], Picture],
    times: Sequence[float],
    fps: float,
    colours_at: Sequence[float],
    progress: Progress | None,
) -> None:
    """Write the frames at some times [s]; those at ``colours_at`` [s] show all of its colours."""
    ready = {time: frame_at(time) for time in colours_at}

    def frames() -> Iterator[Picture]:
        for done, time in enumerate(times, start=1):
            yield ready[time] if time in ready else frame_at(time)
            if progress is not None:
                progress(done, len(times), path.name)

    write_film(path, frames(), fps=fps, palette_from=list(ready.values()))


@contextlib.contextmanager
def _trial_frames(
    replay: Replay, camera: str, size: tuple[int, int], title: str
) -> Iterator[Callable[[float], Picture]]:
    """A function from time [s] to frame, for the time of a ``with`` block."""
    width, height = arm_size(*size)
    with arm_camera(replay, camera=camera, width=width, height=height) as arm:
        sheet = film_sheet(replay.trial, size=size, labels=arm.labels, title=title)
        yield lambda time: sheet.frame(arm.draw(time), time)


def _as_trial(rig: Rig, parts: Sequence[Comparison], first: Comparison, state: str) -> Trial:
    """One state's signals as a trial that can be replayed; its drive is not shown."""
    return Trial(
        name=first.trial,
        protocol=first.protocol,
        drive="valve",
        load=0.0,
        time=first.time,
        command=np.zeros((first.time.size, len(rig.muscles))),
        measured={part.channel: getattr(part, state) for part in parts},
        muscle_names=tuple(rig.names.named_muscles),
    )


class FilmSheet:
    """A figure with a place for the arms, and with a cursor at the time in each of its plots.

    Attributes:
        duration: of the trial [s].
        curves: of each plot over time that gets a cursor, those that get a dot.
    """

    def __init__(
        self,
        figure: Figure,
        place: slice,
        curves: Mapping[Axes, Sequence[Line2D]],
        duration: float,
    ) -> None:
        """Paint what does not move; the place of the arms are rows of the figure [px]."""
        self.curves, self.duration, self._place = curves, duration, place
        self._canvas = FigureCanvasAgg(figure)
        self._cursors = {ax: ax.axvline(0.0, **_CURSOR) for ax in curves}
        self._dots: dict[Line2D, Line2D] = {}
        for ax, lines in curves.items():
            for line in lines:
                (self._dots[line],) = ax.plot([], [], color=line.get_color(), animated=True, **_DOT)
        self._canvas.draw()
        self._still = self._canvas.copy_from_bbox(figure.bbox)

    def frame(self, arms: Picture, time: float) -> Picture:
        """A frame (height, width, 3) from a picture of the arms at a time [s]."""
        self._canvas.restore_region(self._still)
        at = min(max(time, 0.0), self.duration)
        for ax, lines in self.curves.items():
            self._cursors[ax].set_xdata([at, at])
            ax.draw_artist(self._cursors[ax])
            for line in lines:
                times, values = map(np.asarray, line.get_data())
                self._dots[line].set_data([at], [np.interp(at, times, values)])
                ax.draw_artist(self._dots[line])
        painted = np.asarray(self._canvas.buffer_rgba()).astype(np.float32)
        behind = np.full_like(painted[..., :3], 255.0)
        behind[self._place] = arms
        cover = painted[..., 3:] / np.float32(255.0)
        return np.round(behind + (painted[..., :3] - behind) * cover).astype(np.uint8)


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

    The size of a frame is in pixels, and so are column and row of each muscle's fixed end in the
    arm's picture: ``labels``, by the names of the muscles.

    Raises:
        InputError: if the frame is too small for labels.
    """
    width, arm = arm_size(*size)
    figure, above, below = _figure(width, arm, size[1] - arm, dpi=width / _WIDTH_IN)
    _write_over(above, (width, arm), labels, title)
    left, right = below.subplots(1, 2)
    curves = {
        left: plot_joints(left, trial, trial.measured, trial.muscle_names),
        right: plot_pressures(right, trial, trial.measured, trial.muscle_names),
    }
    for ax in curves:
        ax.set_xlabel("time [s]")
        ax.set_xlim(0.0, trial.time[-1])
        ax.margins(y=0.08)
    return FilmSheet(figure, slice(0, arm), curves, float(trial.time[-1]))


def _write_over(
    figure: SubFigure, size: tuple[int, int], labels: Mapping[str, tuple[float, float]], title: str
) -> None:
    width, height = size
    look: dict[str, Any] = {"weight": "bold", "size": 10.5}
    look["path_effects"] = [withStroke(linewidth=3.0, foreground="white")]
    figure.text(0.015, 1.0 - 9.0 / height * width / 400, title, va="top", size=10.5, color=INK)
    top = min((row for _, row in labels.values()), default=0.0)
    pair, written = len(labels) <= 2, list[Bbox]()
    for index, (name, (column, row)) in enumerate(labels.items()):
        upper = row == top  # away from the other muscle
        across, up = (0.0, _ABOVE if upper else _BELOW) if pair else (_WITHIN, 0.0)
        place = column / width + across, 1.0 - row / height + up
        va = ("bottom" if upper else "top") if pair else "center"
        label = figure.text(*place, words(name), va=va, color=series_look(index)[0], **look)
        while any(label.get_window_extent().overlaps(other) for other in written):
            line = label.get_window_extent().height / figure.bbox.height
            label.set_y(label.get_position()[1] - line)
        written.append(label.get_window_extent())


@styled
def gap_sheet(part: Comparison) -> tuple[FilmSheet, list[str]]:
    """What all frames of the film of a gap share, and the states that it shows."""
    before = "simulated" if part.after is None else "before the repair"
    titles = {"measured": ("measured", INK), "before": (before, VERMILION),
              "after": ("after it", BLUE)}  # fmt: skip
    states = [state for state in titles if getattr(part, state) is not None]
    figure, above, below = _figure(len(states) * ARM[0], _TITLE + ARM[1], _CURVES, dpi=_GAP_DPI)
    ax = below.subplots()
    unit, scale = shown_unit(part.channel)
    for place, state in enumerate(states):
        values, (title, colour) = getattr(part, state), titles[state]
        width_pt, opacity = (3.5, 0.35) if state == "measured" else (1.5, 1.0)  # seen around others
        ax.plot(part.time, values * scale, color=colour, linewidth=width_pt, alpha=opacity)
        error = "" if state == "measured" else f": {fixed(part.rms(values), 2)} {unit} RMS"
        middle = (place + 0.5) / len(states), 1.0 - 5.0 / (_TITLE + ARM[1])
        above.text(*middle, title + error, color=colour, weight="bold", ha="center", va="top")
    ax.set_xlim(part.time[0], part.time[-1])
    finish_axes(ax, x="time [s]", y=f"{words(part.channel)} [{unit}]", zero=False)
    place = slice(_TITLE, _TITLE + ARM[1])
    return FilmSheet(figure, place, {ax: ()}, float(part.time[-1])), states


def _figure(
    width: int, above: int, below: int, *, dpi: float
) -> tuple[Figure, SubFigure, SubFigure]:
    """A figure, its part of nothing above and its white part below, of these sizes [px]."""
    # A little more: matplotlib before 3.11 cuts off, and 426.9999 would be 426 pixels.
    size = (width + _SLIVER) / dpi, (above + below + _SLIVER) / dpi
    figure = Figure(figsize=size, dpi=dpi, layout="constrained", facecolor="none")
    parts: Any = figure.subfigures(2, 1, height_ratios=(above, below))
    arms, plots = parts
    plots.set_facecolor("white")
    return figure, arms, plots
