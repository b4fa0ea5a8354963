"""A recording looked at: the state of the rig at any instant of a trial, and pictures of it."""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from pamsim.core.errors import InputError, nearest
from pamsim.core.units import FloatArray
from pamsim.engine.rig import Rig, load_rig
from pamsim.recordings.recording_reader import read_recordings
from pamsim.recordings.signals import column_of
from pamsim.recordings.trial import Trial, of_rig
from pamsim.scene.picture import chosen_camera, open_renderer, render_arm
from pamsim.scene.pose import has_site, pose, seen_by, site_pose

Picture = NDArray[np.uint8]

# Steps too small to be seen, of a joint [rad or m] and a pressure [Pa]: an arm at rest is drawn
# once.
_POSITION_STEP, _PRESSURE_STEP = math.radians(0.02), 1e3
_FINER = 1.5
"""Drawn so much larger and then reduced: smoother than the engine's own smoothing, in less time."""


@dataclass(frozen=True, kw_only=True)
class Replay:
    """One trial of a recording and the rig it is of.

    Attributes:
        rig: loaded with its scene.
        trial: with a measured position of every joint.
        others: names of the recording's other trials.
    """

    rig: Rig
    trial: Trial
    others: tuple[str, ...] = ()

    @property
    def duration(self) -> float:
        """Length of the trial [s]."""
        return float(self.trial.time[-1])

    @property
    def title(self) -> str:
        """What is shown, in a few words."""
        return f"{self.rig.name}, {self.trial.name}, load {self.trial.load:g} kg"

    def positions(self, time: float) -> list[float]:
        """Positions of the rig's joints at a time, linear between samples [rad or m]."""
        return [self._measured(channel, time) for channel in self.rig.names.joint_channels]

    def pressures(self, time: float) -> list[float]:
        """Gauge pressures at a time [Pa], one per muscle; NaN where none was measured."""
        return [self._measured(channel, time) for channel in self.trial.pressure_channels]

    def _measured(self, channel: str, time: float) -> float:
        values = self.trial.measured.get(channel)
        return math.nan if values is None else float(np.interp(time, self.trial.time, values))


def read_replay(
    recording: str | os.PathLike[str],
    *,
    trial: str | None = None,
    rig: str | os.PathLike[str] | None = None,
) -> Replay:
    """Read one trial of a recording, a folder with ``recording.toml`` or that file, to look at.

    It is the first, or that of a name; its rig is the recording's, or that of a name or folder.

    Raises:
        InputError: what `read_recordings` refuses, an unknown trial, a rig with another number of
            muscles, an angle that was not measured.
    """
    recorded = read_recordings(recording)
    named = {each.name: each for each in recorded.trials}
    name = recorded.trials[0].name if trial is None else trial
    if name not in named:
        raise InputError(f"{recording}: no trial {name!r}; {nearest(name, named)}")
    loaded = load_rig(rig or recorded.rig, scene=True, recorded=rig is None)
    try:
        chosen, _ = of_rig(named.pop(name), loaded.names, loaded.name)
    except InputError as error:
        raise InputError(f"{recording}: {error}; give its `rig`") from None
    for channel in loaded.names.joint_channels:
        if channel not in chosen.measured:
            raise InputError(
                f"{recording}: trial {name!r} has no column {column_of(channel)!r}, which a"
                " picture needs"
            )
    return Replay(rig=loaded, trial=chosen, others=tuple(named))


def require_pace(**pace: float) -> None:
    """Refuse a speed or a number of frames per second that is not above 0, by an `InputError`."""
    for name, value in pace.items():
        if not 0.0 < value < math.inf:
            raise InputError(f"`{name}` {value:g} must be above 0")


def frame_times(duration: float, *, fps: float, speed: float) -> FloatArray:
    """Instants (n,) [s] from 0 that the frames of a film show, fps [Hz] of them per second.

    Of a duration [s] at a speed, 1 for real time, the film lasts duration / speed.

    Raises:
        InputError: if fps or speed is not positive.
    """
    require_pace(fps=fps, speed=speed)
    count = max(1, round(duration * fps / speed))
    return np.arange(count, dtype=np.float64) * (speed / fps)


class ArmCamera(NamedTuple):
    """Draws the arm of a replay.

    Attributes:
        draw: time [s] -> (height, width, 3) picture.
        labels: name of each muscle -> column and row where its fixed end is seen [px].
    """

    draw: Callable[[float], Picture]
    labels: dict[str, tuple[float, float]]


@contextlib.contextmanager
def arm_camera(
    replay: Replay, *, camera: str = "overview", width: int, height: int
) -> Iterator[ArmCamera]:
    """Draw a replay by a camera of its scene, in a size [px], for the time of a ``with`` block.

    Raises:
        InputError: for an unknown camera.
        EngineError: if OpenGL cannot start, or the rig has no site that the picture needs.
    """
    rig = replay.rig
    model = rig.model_for(load=replay.trial.load)
    quality = model.vis.quality
    # Drawn in software, each of these costs time in every frame; at a film's size none is missed.
    quality.shadowsize, quality.offsamples = min(quality.shadowsize, 2048), 0
    quality.numslices, quality.numstacks = min(quality.numslices, 32), 3
    data = mujoco.MjData(model)
    view = chosen_camera(model, data, camera, aspect=width / height)
    last: dict[bytes, Picture] = {}

    def draw(time: float) -> Picture:
        positions = np.round(np.divide(replay.positions(time), _POSITION_STEP)) * _POSITION_STEP
        pressures = np.round(np.divide(replay.pressures(time), _PRESSURE_STEP)) * _PRESSURE_STEP
        state = positions.tobytes() + pressures.tobytes()
        if state not in last:
            last.clear()
            pose(model, data, rig.position_addresses, positions.tolist())
            shown = {"muscles": rig.muscles, "pressures": pressures.tolist(), "camera": view}
            fine = Image.fromarray(render_arm(model, data, **shown, renderer=renderer))
            last[state] = np.asarray(fine.resize((width, height), Image.Resampling.LANCZOS))
        return last[state]

    across, down = round(_FINER * width), round(_FINER * height)
    with contextlib.closing(open_renderer(model, width=across, height=down)) as renderer:
        draw(0.0)
        labels = {}
        for number, name in enumerate(rig.muscles, start=1):
            if has_site(model, site := f"muscle_{number}_anchor"):
                anchor, _ = site_pose(model, data, site)
                labels[name] = _pixel(renderer.scene, anchor, width, height)
        yield ArmCamera(draw, labels)


def _pixel(
    scene: mujoco.MjvScene, point: FloatArray, width: int, height: int
) -> tuple[float, float]:
    """Column and row [px] at which the last update's camera of a scene shows a point (3,) [m]."""
    ((across, up),), camera = seen_by(scene, point[None]).tolist(), scene.camera[0]
    # The frustum's heights are given at its near plane; pixels are square.
    scale = height * camera.frustum_near / (camera.frustum_top - camera.frustum_bottom)
    return width / 2.0 + scale * across, height / 2.0 - scale * up
