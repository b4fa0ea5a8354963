"""Pictures of the arm at any instant of a replay, without a screen."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image

from pamsim.scene.picture import open_renderer, render_arm, require_camera
from pamsim.scene.pose import has_site, muscle_lengths, pose, site_pose
from pamsim.scene.replay import Replay

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
