"""What the window plots beside the arm, and that the arm fills the rest of it."""

import itertools
import math

import mujoco
import numpy as np
import pytest

from pamsim.engine.rig import load_rig
from pamsim.scene.live_plots import COLUMN, SPAN, LivePlots, placed
from pamsim.scene.pose import fit_camera, seen_by
from pamsim.scene.series_colours import series_rgb
from pamsim.scene.viewer import window_model


def moved(names, count=400, interval=0.05):
    """Curves of joints that swing, and pressures that drive them a quarter of a period ahead."""
    live = LivePlots(names)
    for time in interval * np.arange(count):
        swing = [0.4 * math.sin(time + k) for k in range(len(names.joints))]
        push = [(300 + 90 * math.cos(time + k)) * 1e3 for k in range(len(names.muscles))]
        live.add(time, swing, push)
    return live


def curves(figure):
    """Name, colour and points (n, 2) of the curves of a figure."""
    return [
        (name.decode(), colour.tolist(), data[: 2 * count].reshape(-1, 2))
        for name, colour, data, count in zip(
            figure.linename, figure.linergb, figure.linedata, figure.linepnt, strict=True
        )
        if count
    ]


def test_plots_show_units_of_screens_and_the_present_values():
    live = moved(load_rig("mas20_arm").names)
    turning, filled, loop = live.figures()
    ((_, _, points),) = curves(turning)
    time, angle = points.T
    np.testing.assert_allclose(angle, np.degrees(0.4 * np.sin(time)), atol=1e-4)
    assert turning.title == f"shaft {angle[-1]:.1f} deg"
    assert turning.range[0] == pytest.approx((time[-1] - SPAN, time[-1]))
    assert time[0] >= time[-1] - SPAN - 1e-5
    for index, (name, colour, points) in enumerate(curves(filled)):
        time, pressure = points.T
        np.testing.assert_allclose(pressure, 300 + 90 * np.cos(time + index), rtol=1e-6)
        assert name == f"muscle {index + 1} {pressure[-1]:.0f} kPa"
        assert colour == pytest.approx(series_rgb(index))
    assert index == 1
    difference = [90 * (np.cos(t) - np.cos(t + 1)) for t in 0.05 * np.arange(400)]
    np.testing.assert_allclose(curves(loop)[0][2][:, 0], difference, atol=1e-4)
    assert loop.xlabel == "muscle 1 - muscle 2 [kPa]"
    # An earlier time starts over, and a pressure that was not measured has no curve.
    live.add(0.0, [0.1], [math.nan, 2e5])
    turning, filled = live.figures()  # and no loop
    assert curves(turning)[0][2].tolist() == [[0.0, pytest.approx(math.degrees(0.1))]]
    assert [name for name, *_ in curves(filled)] == ["muscle 2 200 kPa"]


def test_the_longest_curves_fit_one_below_the_other_with_a_colour_each():
    room = mujoco.MjrRect(0, 0, 1200, 800)
    drawn = placed(moved(load_rig("two_joint_arm").names, count=3000).figures(), room)
    edges = [(place.bottom, place.bottom + place.height) for place, _ in drawn]
    assert edges[0][1] >= edges[0][0] >= edges[1][1] >= edges[1][0] >= edges[2][1]
    for count, (place, figure) in zip((2, 4, 1), drawn, strict=True):
        assert place.left + place.width <= math.ceil(COLUMN * room.width)
        assert len(curves(figure)) == count
        assert len({tuple(colour) for _, colour, _ in curves(figure)}) == count
    assert len(curves(drawn[2][1])[0][2]) == 1000


@pytest.mark.parametrize("name", ["mas20_arm", "two_joint_arm", "equimus_leg", "muscle_bench"])
def test_the_arm_fills_the_window_beside_the_plots_at_every_limit_of_its_joints(name):
    model = window_model(load_rig(name, scene=True), {"pressure": (0.0, 600.0)})
    limits = [None, *itertools.product(np.flatnonzero(model.jnt_limited), (0, 1))]
    solid = model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE
    for aspect in (0.9, 1.6, 2.4):
        data, camera = mujoco.MjData(model), mujoco.MjvCamera()
        fit_camera(camera, model, data, aspect=aspect, column=COLUMN)
        np.testing.assert_array_equal(data.qpos, model.qpos0)
        places, scene = [], mujoco.MjvScene(model, maxgeom=1)
        mujoco.mjv_updateCamera(model, data, camera, scene)
        half = math.tan(math.radians(model.vis.global_.fovy) / 2) * np.array([aspect, 1.0])
        for limit in limits:
            mujoco.mj_resetData(model, data)
            if limit:
                data.qpos[model.jnt_qposadr[limit[0]]] = model.jnt_range[limit]
            mujoco.mj_forward(model, data)
            places.append(seen_by(scene, data.geom_xpos[solid]) / half)
        seen = np.concatenate(places)
        assert seen[:, 0].min() > 2 * COLUMN - 1
        assert np.abs(seen[:, 1]).max() < 1
        assert seen[:, 0].max() < 1
        # Centres of geoms stay a little inside what their corners fill.
        share = np.ptp(seen, axis=0) / (2 - 2 * COLUMN, 2)
        assert share.max() > 0.7, aspect
