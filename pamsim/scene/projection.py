"""Where points of the world come to lie in a picture."""

from __future__ import annotations

import mujoco
import numpy as np
import numpy.typing as npt


def pixel_places(
    scene: mujoco.MjvScene, points: npt.ArrayLike, *, width: int, height: int
) -> npt.NDArray[np.float64]:
    """Project points by the perspective camera that a scene was last updated with.

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
