"""Simple solids added to a drawn scene: they have no mass, touch nothing and stay for one frame."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import EngineError

Vector = NDArray[np.float64]
Rgba = tuple[float, float, float, float]
CYLINDER, CAPSULE = mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_CAPSULE
BOX, ELLIPSOID = mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_ELLIPSOID


def add_rod(
    scene: mujoco.MjvScene,
    start: Vector,
    end: Vector,
    radius: float,
    rgba: Rgba,
    *,
    kind: mujoco.mjtGeom = CYLINDER,
    gloss: float = 0.5,
    shadow: bool = True,
) -> None:
    """Add a solid between two points.

    Args:
        scene: it is added to.
        start: (3,) one end of the axis [m].
        end: (3,) the other end [m].
        radius: across the axis; of a box half its thickness [m].
        rgba: colour and opacity, 0 to 1.
        kind: ``CYLINDER``, ``CAPSULE``, ``BOX`` or ``ELLIPSOID``.
        gloss: specular reflection, 0 to 1.
        shadow: whether it casts one.

    Raises:
        EngineError: if the scene is full.
    """
    geom = _new(scene, CYLINDER, np.zeros(3), np.zeros(3), np.eye(3), rgba, gloss)
    mujoco.mjv_connector(geom, CYLINDER, radius, start, end)
    geom.type = kind
    if not shadow:
        geom.category = mujoco.mjtCatBit.mjCAT_DECOR


def add_box(
    scene: mujoco.MjvScene, centre: Vector, axes: Vector, halves: Vector, rgba: Rgba, gloss: float
) -> None:
    """Add a box, its halves (3,) along the columns of its axes (3, 3); else as `add_rod`."""
    _new(scene, BOX, halves, centre, axes, rgba, gloss)


def _new(
    scene: mujoco.MjvScene,
    kind: mujoco.mjtGeom,
    size: Vector,
    position: Vector,
    axes: Vector,
    rgba: Rgba,
    gloss: float,
) -> Any:
    if scene.ngeom >= scene.maxgeom:
        raise EngineError(
            f"the scene is full ({scene.maxgeom} geoms): open it with a larger maxgeom"
        )
    geom = scene.geoms[scene.ngeom]
    colour = np.array(rgba, dtype=np.float32)
    mujoco.mjv_initGeom(geom, kind, size, position, axes.flatten(), colour)
    geom.category = mujoco.mjtCatBit.mjCAT_DYNAMIC  # decor casts no shadow
    geom.specular = geom.shininess = gloss
    scene.ngeom += 1
    return geom
