"""Films and pictures of a recording, put together from its pictures of the arm and its plots."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray

from pamsim.cli.output import progress_bar
from pamsim.core.errors import InputError
from pamsim.report.film_sheet import FilmSheet, arm_size, film_sheet
from pamsim.scene.arm_camera import ArmCamera, arm_camera
from pamsim.scene.replay import Replay, frame_times, read_replay
from pamsim.store.film_file import check_film, write_film
from pamsim.store.picture_file import write_picture

_PALETTE_FRAMES = 5


@dataclass(frozen=True, kw_only=True)
class Shot:
    """What is shown and how.

    Attributes:
        recording: folder with ``recording.toml``, or that file.
        trial: of it; the first if None.
        rig: name or folder; the recording's if None.
        camera: of the rig's scene.
        size: width and height [px].
    """

    recording: Path
    trial: str | None
    rig: str | None
    camera: str
    size: tuple[int, int]


@dataclass(frozen=True, kw_only=True)
class _Stage:
    """An arm and a sheet ready for frames."""

    sheet: FilmSheet
    arm: ArmCamera

    def frame(self, time: float) -> NDArray[np.uint8]:
        return self.sheet.frame(self.arm.draw(time), time)


def make_film(path: Path, shot: Shot, *, fps: float, speed: float) -> None:
    """Write a film of a whole trial.

    Args:
        path: ending in .gif or .mp4.
        shot: what is shown.
        fps: frames per second of the film [Hz].
        speed: 1 for real time.

    Raises:
        InputError: for a recording, an option or a place that cannot be used.
        EngineError: if the arm cannot be drawn.
    """
    check_film(path, fps)
    replay = read_replay(shot.recording, trial=shot.trial, rig=shot.rig)
    times = frame_times(replay.duration, fps=fps, speed=speed).tolist()
    pace = f", at {speed:g} times its speed" if speed != 1.0 else ""
    with _stage(replay, shot, replay.title + pace) as stage, progress_bar("frame") as progress:
        ready = {
            time: stage.frame(time) for time in times[:: max(1, len(times) // _PALETTE_FRAMES)]
        }

        def frames() -> Iterator[NDArray[np.uint8]]:
            for done, time in enumerate(times, start=1):
                yield ready[time] if time in ready else stage.frame(time)
                progress(done, len(times), path.name)

        write_film(path, frames(), fps=fps, palette_from=list(ready.values()))
    _say_which(replay)


def make_instant(path: Path, shot: Shot, *, time: float) -> None:
    """Write a picture of one instant of a trial.

    Args:
        path: ending in .png or .jpg.
        shot: what is shown.
        time: [s], within the trial.

    Raises:
        InputError: for a recording, a time or a place that cannot be used.
        EngineError: if the arm cannot be drawn.
    """
    replay = read_replay(shot.recording, trial=shot.trial, rig=shot.rig)
    if not 0.0 <= time <= replay.duration:
        raise InputError(
            f"--time {time:g} s is not in trial {replay.trial.name!r}, which lasts"
            f" {replay.duration:g} s"
        )
    with _stage(replay, shot, replay.title) as stage:
        write_picture(path, stage.frame(time))
    _say_which(replay)


@contextlib.contextmanager
def _stage(replay: Replay, shot: Shot, title: str) -> Iterator[_Stage]:
    wide, high = arm_size(*shot.size)
    with arm_camera(replay, camera=shot.camera, width=wide, height=high) as arm:
        sheet = film_sheet(
            replay.trial,
            width=shot.size[0],
            height=shot.size[1],
            labels=arm.labels,
            title=title,
        )
        yield _Stage(sheet=sheet, arm=arm)


def _say_which(replay: Replay) -> None:
    if replay.others:
        click.echo(f"trial {replay.trial.name}; others by --trial: {', '.join(replay.others)}")
