"""Films and pictures of recorded trials: arms above, their signals below, a cursor at the time.

`film_trial` shows one arm as it was recorded, `film_gap` the arm as measured beside the arm as
simulated; what stands still is drawn once (`pamsim.report.film_sheet`).
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from pamsim.comparison.compared_signal import Comparison
from pamsim.core.computation import Progress
from pamsim.core.errors import InputError
from pamsim.engine.rig import Rig
from pamsim.recordings.pictures import check_film, write_film, write_picture
from pamsim.recordings.trial import Trial
from pamsim.report.film_sheet import ARM, Picture, arm_size, film_sheet, gap_sheet
from pamsim.scene.replay import Replay, arm_camera, frame_times

_PALETTE_FRAMES = 5
_GAP_FPS = 12.0
_LONGEST = 4.0  # of the film of a gap [s]; a longer trial runs faster


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
