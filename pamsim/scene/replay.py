"""A recording looked at: the state of the rig at any instant of a trial, and pictures of it."""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image

from pamsim.core.errors import InputError, nearest
from pamsim.engine.rig import Rig, load_rig
from pamsim.recordings.recording_reader import read_recordings
from pamsim.recordings.signals import column_of
from pamsim.recordings.trial import Trial, of_rig
from pamsim.scene.picture import open_renderer, render_arm, require_camera
from pamsim.scene.pose import has_site, muscle_lengths, pose, site_pose


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
        return [
            float(np.interp(time, self.trial.time, self.trial.measured[channel]))
            for channel in self.rig.names.joint_channels
        ]

    def pressures(self, time: float) -> list[float]:
        """Gauge pressures at a time [Pa], one per muscle; NaN where none was measured."""
        measured = self.trial.measured
        return [
            float(np.interp(time, self.trial.time, measured[channel]))
            if channel in measured
            else math.nan
            for channel in self.trial.pressure_channels
        ]


def read_replay(
    recording: str | os.PathLike[str],
    *,
    trial: str | None = None,
    rig: str | os.PathLike[str] | None = None,
) -> Replay:
    """Read one trial of a recording to look at.

    Args:
        recording: folder with ``recording.toml``, or that file.
        trial: its name; the first if None.
        rig: name or folder of a rig instead of the one the recording names.

    Raises:
        InputError: what `read_recordings` refuses, an unknown trial, a rig with another number of
            muscles, an angle that was not measured.
    """
    recorded = read_recordings(recording)
    named = {each.name: each for each in recorded.trials}
    if trial is not None and trial not in named:
        raise InputError(f"{recording}: no trial {trial!r}; {nearest(trial, named)}")
    chosen = recorded.trials[0] if trial is None else named[trial]
    loaded = load_rig(recorded.rig if rig is None else rig, scene=True)
    try:
        chosen, _ = of_rig(chosen, loaded.names, loaded.name)
    except InputError as error:
        raise InputError(f"{recording}: {error}; give its `rig`") from None
    for channel in loaded.names.joint_channels:
        if channel not in chosen.measured:
            raise InputError(
                f"{recording}: trial {chosen.name!r} has no column {column_of(channel)!r}, which a"
                " picture needs"
            )
    others = tuple(name for name in named if name != chosen.name)
    return Replay(rig=loaded, trial=chosen, others=others)


def frame_times(duration: float, *, fps: float, speed: float) -> NDArray[np.float64]:
    """Instants that the frames of a film show.

    Args:
        duration: of what is filmed [s].
        fps: frames per second of the film [Hz].
        speed: 1 for real time, 0.5 for slow motion.

    Returns:
        (n,) [s] from 0, n = duration fps / speed, so that the film lasts duration / speed.

    Raises:
        InputError: if fps or speed is not positive.
    """
    for name, value in (("fps", fps), ("speed", speed)):
        if not 0.0 < value < np.inf:
            raise InputError(f"`{name}` {value:g} must be above 0")
    count = max(1, round(duration * fps / speed))
    return np.arange(count, dtype=np.float64) * (speed / fps)


Picture = NDArray[np.uint8]

# Steps too small to be seen, of a joint [rad or m] and a pressure [Pa]: an arm at rest is drawn
# once.
_POSITION_STEP, _PRESSURE_STEP = math.radians(0.02), 1e3
_FINER = 1.5
"""Drawn so much larger and then reduced: smoother than the engine's own smoothing, in less time."""


@dataclass(frozen=True, kw_only=True)
class ArmCamera:
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
    """Draw a replay as often as wanted for the time of a ``with`` block.

    Args:
        replay: of `read_replay`.
        camera: of the rig's scene.
        width: of the picture [px].
        height: of the picture [px].

    Raises:
        InputError: for an unknown camera.
        EngineError: if OpenGL cannot start, or the rig has no site that the picture needs.
    """
    model = replay.rig.model_for(load=replay.trial.load)
    require_camera(model, camera)
    quality = model.vis.quality
    # Drawn in software, each of these costs time in every frame; at a film's size none is missed.
    quality.shadowsize, quality.offsamples = min(quality.shadowsize, 2048), 0
    quality.numslices, quality.numstacks = min(quality.numslices, 32), 3
    data = mujoco.MjData(model)
    renderer = open_renderer(model, width=round(_FINER * width), height=round(_FINER * height))
    addresses = replay.rig.position_addresses
    last: dict[tuple[int | None, ...], Picture] = {}

    def draw(time: float) -> Picture:
        positions = [round(p / _POSITION_STEP) for p in replay.positions(time)]
        pressures = [
            None if math.isnan(pressure) else round(pressure / _PRESSURE_STEP)
            for pressure in replay.pressures(time)
        ]
        state = (*positions, *pressures)
        if state not in last:
            pose(model, data, addresses, [p * _POSITION_STEP for p in positions])
            fine = render_arm(
                model,
                data,
                muscles=replay.rig.muscles,
                pressures=[math.nan if p is None else p * _PRESSURE_STEP for p in pressures],
                lengths=muscle_lengths(model, data),
                camera=camera,
                renderer=renderer,
            )
            picture = np.asarray(
                Image.fromarray(fine).resize((width, height), Image.Resampling.LANCZOS)
            )
            last.clear()
            last[state] = picture
        return last[state]

    try:
        draw(0.0)
        sites = {n: f"muscle_{i}_anchor" for i, n in enumerate(replay.rig.muscles, start=1)}
        muscles = [name for name, site in sites.items() if has_site(model, site)]
        anchors = np.reshape([site_pose(model, data, sites[name])[0] for name in muscles], (-1, 3))
        places = _pixel_places(renderer.scene, anchors, width=width, height=height).tolist()
        labels = {name: (x, y) for name, (x, y) in zip(muscles, places, strict=True)}
        yield ArmCamera(draw=draw, labels=labels)
    finally:
        renderer.close()


def _pixel_places(
    scene: mujoco.MjvScene, points: ArrayLike, *, width: int, height: int
) -> NDArray[np.float64]:
    """Project points with the perspective camera of a scene's last update.

    Args:
        scene: of a renderer, after ``update_scene``.
        points: (k, 3) in front of the camera [m].
        width: of the picture [px].
        height: of the picture [px].

    Returns:
        (k, 2) column and row, counted from the upper left corner [px].
    """
    left, right = scene.camera[0], scene.camera[1]
    eye = (np.array(left.pos) + np.array(right.pos)) / 2.0
    forward, up = np.array(left.forward), np.array(left.up)
    seen = np.asarray(points, dtype=float) - eye
    depth = seen @ forward
    # The frustum's heights are given at its near plane; pixels are square.
    per_metre = height * left.frustum_near / (left.frustum_top - left.frustum_bottom) / depth
    column = width / 2.0 + per_metre * (seen @ np.cross(forward, up))
    row = height / 2.0 - per_metre * (seen @ up)
    return np.column_stack([column, row])
