"""Films and pictures of a recorded trial: the arm on top, its angle and pressures below."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from pamsim.core.computation import Progress
from pamsim.core.errors import InputError
from pamsim.recordings.pictures import check_film, write_film, write_picture
from pamsim.report.film_sheet import Picture, arm_size, film_sheet
from pamsim.scene.replay import Replay, arm_camera, frame_times

_PALETTE_FRAMES = 5


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
    """Write a film of a whole trial.

    Args:
        path: ending in .gif or .mp4.
        replay: of `pamsim.scene.replay.read_replay`.
        camera: of the rig's scene.
        size: width and height [px].
        fps: frames per second of the film [Hz].
        speed: 1 for real time, 0.5 for slow motion.
        progress: called after each frame.

    Raises:
        InputError: for an unknown camera or film format, a number out of range, a place that
            cannot be written.
        EngineError: if the arm cannot be drawn.
    """
    check_film(path, fps)
    times = frame_times(replay.duration, fps=fps, speed=speed).tolist()
    pace = f", at {speed:g} times its speed" if speed != 1.0 else ""
    with _camera(replay, camera, size, replay.title + pace) as frame_at:
        some = times[:: max(1, len(times) // _PALETTE_FRAMES)]
        write_frames(path, frame_at, times, fps=fps, colours_at=some, progress=progress)


def write_frames(
    path: Path,
    frame_at: Callable[[float], Picture],
    times: Sequence[float],
    *,
    fps: float,
    colours_at: Sequence[float],
    progress: Progress | None,
) -> None:
    """Write the frames at some times [s], see `pamsim.recordings.pictures.write_film`.

    Those at ``colours_at`` [s] show all colours of the film.
    """
    ready = {time: frame_at(time) for time in colours_at}

    def frames() -> Iterator[Picture]:
        for done, time in enumerate(times, start=1):
            yield ready[time] if time in ready else frame_at(time)
            if progress is not None:
                progress(done, len(times), path.name)

    write_film(path, frames(), fps=fps, palette_from=list(ready.values()))


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
        InputError: for an unknown camera or picture format, a time outside the trial, a place that
            cannot be written.
        EngineError: if the arm cannot be drawn.
    """
    if not 0.0 <= time <= replay.duration:
        raise InputError(
            f"`time` {time:g} s is not in trial {replay.trial.name!r}, which lasts"
            f" {replay.duration:g} s"
        )
    with _camera(replay, camera, size, replay.title) as frame_at:
        write_picture(path, frame_at(time))


@contextlib.contextmanager
def _camera(
    replay: Replay, camera: str, size: tuple[int, int], title: str
) -> Iterator[Callable[[float], Picture]]:
    """A function from time [s] to frame, for the time of a ``with`` block."""
    width, height = size
    arm_width, arm_height = arm_size(width, height)
    with arm_camera(replay, camera=camera, width=arm_width, height=arm_height) as arm:
        sheet = film_sheet(replay.trial, width=width, height=height, labels=arm.labels, title=title)
        yield lambda time: sheet.frame(arm.draw(time), time)
