"""Where things stand in the window: plots in a column on the left, the arm filling the rest."""

from __future__ import annotations

import math
from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.scene.live_plots import Plot

COLUMN = 0.3
"""Share of the window's width that the plots take."""
_FILLED = 0.94
"""Share of the rest that the arm fills, in width or in height."""
_WHITE, _INK, _GRID = (1.0, 1.0, 1.0, 0.92), (0.12, 0.14, 0.17), (0.84, 0.86, 0.88)
_DARK = (0.1, 0.11, 0.13, 0.8)  # the engine gives the legend's letters a dark rim
_LINE = 0.15  # of the legend, as a share of the curves' height
_ROUNDS = 30
_CAMERA = "overview"


def fit_camera(
    camera: mujoco.MjvCamera,
    model: mujoco.MjModel,
    data: mujoco.MjData,
    *,
    aspect: float,
    column: float,
) -> None:
    """Turn a free camera so that the arm fills the window beside the plots wherever it moves.

    It looks in the direction of the scene's camera ``overview``, if there is one.

    Args:
        camera: changed in place.
        model: shown.
        data: of it; put into the limits of its joints and back.
        aspect: width of the window over its height.
        column: share of the width at the left that is left free.
    """
    mujoco.mjv_defaultFreeCamera(model, camera)
    fixed = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_CAMERA, _CAMERA)
    if fixed >= 0:
        mujoco.mj_forward(model, data)
        ahead = -data.cam_xmat[fixed].reshape(3, 3)[:, 2]
        camera.azimuth = math.degrees(math.atan2(ahead[1], ahead[0]))
        camera.elevation = math.degrees(math.asin(ahead[2]))
    points = _reach(model, data)
    camera.lookat = points.mean(axis=0)
    camera.distance = 3.0 * float(np.ptp(points, axis=0).max())
    low, high = np.array([2.0 * column - 1.0, -1.0]), np.ones(2)
    half = math.tan(math.radians(model.vis.global_.fovy) / 2.0) * np.array([aspect, 1.0])
    for _ in range(_ROUNDS):
        placed = window_places(camera, points, half)
        least, most = placed.min(axis=0), placed.max(axis=0)
        move = ((least + most) - (low + high)) / 2.0 * half * camera.distance
        camera.lookat = camera.lookat + move @ _axes(camera)[1:]
        camera.distance *= float(((most - least) / (high - low)).max()) / _FILLED


def window_places(
    camera: mujoco.MjvCamera, points: NDArray[np.float64], half: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Where a free camera shows points, (n, 2): -1 to 1 from left to right, from bottom to top.

    Args:
        camera: free.
        points: (n, 3) [m].
        half: (2,) tangents of half the width and half the height seen.
    """
    axes = _axes(camera)
    ahead, *across = ((points - camera.lookat) @ axes.T + [camera.distance, 0.0, 0.0]).T
    return np.column_stack(across) / ahead[:, None] / half


def _axes(camera: mujoco.MjvCamera) -> NDArray[np.float64]:
    """Ahead, right and up of a free camera, (3, 3)."""
    turn, lift = math.radians(camera.azimuth), math.radians(camera.elevation)
    ahead = np.array(
        [math.cos(lift) * math.cos(turn), math.cos(lift) * math.sin(turn), math.sin(lift)]
    )
    right = np.array([math.sin(turn), -math.cos(turn), 0.0])
    return np.array([ahead, right, np.cross(right, ahead)])


def _reach(model: mujoco.MjModel, data: mujoco.MjData) -> NDArray[np.float64]:
    """Corners of every geom but floors, at rest and with each joint at its limits, (n, 3) [m]."""
    before = data.qpos.copy()
    poses = [before]
    for joint in np.flatnonzero(model.jnt_limited):
        for limit in model.jnt_range[joint]:
            poses.append(before.copy())
            poses[-1][model.jnt_qposadr[joint]] = limit
    solid = model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE
    signs = np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).reshape(3, 8).T
    corners = model.geom_aabb[solid, None, :3] + signs * model.geom_aabb[solid, None, 3:]
    found = []
    for positions in poses:
        data.qpos[:] = positions
        mujoco.mj_kinematics(model, data)
        turned = data.geom_xmat[solid].reshape(-1, 3, 3)
        found.append(corners @ turned.transpose(0, 2, 1) + data.geom_xpos[solid, None])
    data.qpos[:] = before
    mujoco.mj_kinematics(model, data)
    return np.concatenate(found).reshape(-1, 3)


def figures(
    plots: Sequence[Plot], viewport: mujoco.MjrRect
) -> list[tuple[mujoco.MjrRect, mujoco.MjvFigure]]:
    """The plots one below the other at the left edge of a window, as MuJoCo draws them."""
    width, height = int(COLUMN * viewport.width), viewport.height // max(len(plots), 1)
    return [
        (
            mujoco.MjrRect(
                viewport.left, viewport.bottom + (len(plots) - 1 - row) * height, width, height
            ),
            _figure(plot),
        )
        for row, plot in enumerate(plots)
    ]


def _figure(plot: Plot) -> mujoco.MjvFigure:
    figure = mujoco.MjvFigure()
    mujoco.mjv_defaultFigure(figure)
    figure.title, figure.xlabel = plot.title, plot.across
    figure.figurergba, figure.panergba, figure.legendrgba = _WHITE, _WHITE, _DARK
    figure.textrgb, figure.gridrgb = _INK, _GRID
    figure.gridsize, figure.linewidth = (6 if plot.across_range else 4, 5), 2.0
    named = sum(bool(curve.name) for curve in plot.curves)
    figure.flg_legend = int(named > 0)
    figure.xformat, figure.yformat = "%.0f", "%.0f"
    if plot.across_range is not None:
        figure.range[0] = plot.across_range
    figure.range[1] = 1.0, 0.0  # from the curves
    if named:  # with room for the legend above them
        values = np.concatenate([curve.points[:, 1] for curve in plot.curves])
        low, high = min(values.min(), 0.0), max(values.max(), 1.0)
        figure.range[1] = low, high + (0.1 + _LINE * named) * (high - low)
    for index, curve in enumerate(plot.curves):
        count = len(curve.points)
        figure.linepnt[index] = count
        figure.linergb[index] = curve.colour
        figure.linename[index] = curve.name
        figure.linedata[index, : 2 * count] = curve.points.ravel()
    return figure
