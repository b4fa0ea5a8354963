"""Film of the gap: the arm as measured, as simulated before and after the repair, side by side."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from pamsim.comparison.compared_signal import Comparison, shown_unit
from pamsim.core.computation import Progress
from pamsim.core.errors import InputError
from pamsim.engine.rig import Rig
from pamsim.recordings.trial import Trial
from pamsim.report.film import write_frames
from pamsim.report.film_sheet import Picture, Plot, painted, painted_plot
from pamsim.report.numbers import fixed, words
from pamsim.report.style import BLUE, INK, VERMILION, finish_axes, styled
from pamsim.scene.replay import Replay, arm_camera, frame_times

_FPS = 12.0
_LONGEST = 4.0  # of the film [s]; a longer trial runs faster
_ARM = 320, 172  # width and height of each arm [px]
_TITLE, _CURVES = 26, 150  # height of the titles above the arms and of the curves below [px]
_DPI = 100.0


def film_gap(
    path: Path, rig: Rig, parts: Sequence[Comparison], *, progress: Progress | None = None
) -> None:
    """Write a film of one trial, its arms above and the first joint's curves below.

    Args:
        path: ending in .gif or .mp4.
        rig: loaded with its scene.
        parts: the compared channels of the trial, all joints among them.
        progress: called after each frame.

    Raises:
        InputError: if a joint was not compared, or the place cannot be written.
        EngineError: if the arm cannot be drawn.
    """
    missing = set(rig.names.joint_channels) - {part.channel for part in parts}
    if missing:
        raise InputError(f"{path}: {', '.join(sorted(missing))} was not compared")
    (first,) = (part for part in parts if part.channel == rig.names.joint_channels[0])
    before = "simulated" if first.after is None else "before the repair"
    titles = {"measured": ("measured", INK), "before": (before, VERMILION),
              "after": ("after it", BLUE)}  # fmt: skip
    states = [state for state in titles if getattr(first, state) is not None]
    replays = [Replay(rig=rig, trial=_trial(rig, parts, first, state)) for state in states]
    duration = replays[0].duration
    times = frame_times(duration, fps=_FPS, speed=max(duration / _LONGEST, 1.0)).tolist()
    sheet, plot = _sheet(first, {state: titles[state] for state in states})
    width, height = _ARM
    with contextlib.ExitStack() as stack:
        cameras = [
            stack.enter_context(arm_camera(replay, width=width, height=height))
            for replay in replays
        ]

        def frame_at(time: float) -> Picture:
            frame = sheet.copy()
            arms = np.hstack([camera.draw(time) for camera in cameras])
            frame[_TITLE : _TITLE + height] = arms
            plot.paint_cursor(frame, time / duration)
            return frame

        ends = (0.0, duration)
        write_frames(path, frame_at, times, fps=_FPS, colours_at=ends, progress=progress)


def _trial(rig: Rig, parts: Sequence[Comparison], first: Comparison, state: str) -> Trial:
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


@styled
def _sheet(part: Comparison, titles: Mapping[str, tuple[str, str]]) -> tuple[Picture, Plot]:
    """What all frames share: titles and curves; and where the curves are."""
    width, height = len(titles) * _ARM[0], _TITLE + _ARM[1] + _CURVES
    figure = Figure(figsize=(width / _DPI, height / _DPI), dpi=_DPI)
    FigureCanvasAgg(figure)
    left, bottom, right = 62 / width, 40 / height, 26 / width
    ax = figure.add_axes((left, bottom, 1.0 - left - right, (_CURVES - 50) / height))
    unit, scale = shown_unit(part.channel)
    for place, (state, (title, colour)) in enumerate(titles.items()):
        values = getattr(part, state)
        width_pt, opacity = (3.5, 0.35) if state == "measured" else (1.5, 1.0)  # seen around others
        ax.plot(part.time, values * scale, color=colour, linewidth=width_pt, alpha=opacity)
        error = "" if state == "measured" else f": {fixed(part.rms(values), 2)} {unit} RMS"
        across = (place + 0.5) / len(titles)
        figure.text(
            across, 1.0 - 5 / height, f"{title}{error}",
            color=colour, weight="bold", ha="center", va="top",
        )  # fmt: skip
    ax.set_xlim(part.time[0], part.time[-1])
    finish_axes(ax, x="time [s]", y=f"{words(part.channel)} [{unit}]", zero=False)
    return painted(figure)[..., :3].copy(), painted_plot(ax)
