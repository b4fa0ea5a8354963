"""Simple solids added to a drawn scene: they have no mass, touch nothing and stay for one frame."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from pamsim.core.errors import EngineError
from pamsim.core.units import FloatArray

Vector = FloatArray
Rgba = tuple[float, float, float, float]
CYLINDER, CAPSULE = mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_CAPSULE
BOX, ELLIPSOID = mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_ELLIPSOID
_NOBODY = int(mujoco.mjtObj.mjOBJ_UNKNOWN)
_ORIGIN, _UPRIGHT = np.zeros(3), np.eye(3)
_SHADOWLESS, _SHADOWY = int(mujoco.mjtCatBit.mjCAT_DECOR), int(mujoco.mjtCatBit.mjCAT_DYNAMIC)


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
    """Add a solid between two points (3,) [m], with a radius [m], of a box half its thickness.

    Colour, opacity and gloss, its specular reflection, are from 0 to 1.

    Raises:
        EngineError: if the scene is full.
    """
    geom = add_box(scene, _ORIGIN, _UPRIGHT, _ORIGIN, rgba, gloss)
    mujoco.mjv_connector(geom, CYLINDER, radius, start, end)
    geom.type = kind
    if not shadow:
        geom.category = _SHADOWLESS


def add_box(
    scene: mujoco.MjvScene,
    centre: Vector,
    axes: Vector,
    halves: Sequence[float] | Vector,
    rgba: Rgba,
    gloss: float = 0.5,
) -> Any:
    """Add a box of half sizes (3,) [m] along the columns of its axes (3, 3); else as `add_rod`."""
    if scene.ngeom >= scene.maxgeom:
        raise EngineError(
            f"the scene is full ({scene.maxgeom} geoms): open it with a larger maxgeom"
        )
    geom = scene.geoms[scene.ngeom]
    mujoco.mjv_initGeom(geom, BOX, halves, centre, axes.flatten(), np.array(rgba, np.float32))
    # The call above leaves what memory held in these: whose geom it is, and how it is sorted.
    geom.objtype, geom.category, geom.transparent = _NOBODY, _SHADOWY, 0
    geom.specular = geom.shininess = gloss
    scene.ngeom += 1
    return geom
