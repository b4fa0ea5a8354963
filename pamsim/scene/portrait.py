"""A picture of a rig at rest under given pressures."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import mujoco

from pamsim.core.experiment import pressure_step
from pamsim.engine.rig import load_rig
from pamsim.engine.simulate import simulate
from pamsim.scene.named import require_camera
from pamsim.scene.picture import render_arm
from pamsim.scene.pose import muscle_lengths, pose
from pamsim.store.picture_file import write_picture


def portrait(
    path: Path,
    *,
    rig: str | os.PathLike[str] = "mas20_arm",
    pressures: Sequence[float] = (487e3, 100e3),
    load: float = 0.0,
    camera: str = "overview",
    size: tuple[int, int] = (1600, 1000),
) -> None:
    """Let a rig come to rest at some pressures and draw it.

    Args:
        path: picture file, png or jpg.
        rig: name of a shipped rig or a rig folder.
        pressures: gauge pressures, one per muscle [Pa].
        load: [kg].
        camera: of the rig's scene.
        size: width and height in pixels.

    Raises:
        InputError: for an unknown rig, camera or picture format.
        EngineError: if OpenGL cannot start; the text names the fix.
    """
    loaded = load_rig(rig, scene=True)
    rest = simulate(loaded, pressure_step(pressures, pressures, duration=0.01, load=load))
    rest.completed()
    model = loaded.model_for(load=load)
    require_camera(model, camera)
    data = mujoco.MjData(model)
    pose(model, data, loaded.angle_address, float(rest.angle[-1]))
    image = render_arm(
        model,
        data,
        pressures=rest.pressure[-1].tolist(),
        lengths=muscle_lengths(model, data),
        width=size[0],
        height=size[1],
        camera=camera,
    )
    write_picture(path, image)
