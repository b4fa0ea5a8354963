"""The shipped rig's MJCF, and pictures of it."""

from __future__ import annotations

import dataclasses
import math
import os
import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest

import pamsim
from pamsim.core.errors import EngineError, InputError
from pamsim.scene.parts import ELLIPSOID, MOVING_REACH, WALL, Strand, add_muscle, outer_radius
from pamsim.scene.picture import decorate, open_renderer, render_arm, show_whole
from pamsim.scene.pose import muscle_lengths, pose
from tests.unit.scene.films import nearest_series, needs_gl

FOLDER = Path(__file__).parents[3] / "models" / "mas20_arm"
RADIUS = 0.0125
MUSCLES = pamsim.load_rig("mas20_arm").muscles
BRAID = next(iter(MUSCLES.values())).braided
LIMIT = math.pi / 3
SIZE = {"width": 400, "height": 250}
STATE = {"muscles": MUSCLES, "pressures": (2e5, 3e5), "lengths": (0.25, 0.25)}


@pytest.fixture
def warnings():
    """Collect what the engine warns of."""
    heard = []
    mujoco.set_mju_user_warning(heard.append)
    yield heard
    mujoco.set_mju_user_warning(None)


@pytest.fixture
def model():
    return mujoco.MjModel.from_xml_path(str(FOLDER / "mas20_arm.xml"))


@pytest.fixture
def scene():
    model = mujoco.MjModel.from_xml_path(str(FOLDER / "scene.xml"))
    # Drawn in software: a rougher picture shows the same in a fraction of the time.
    quality = model.vis.quality
    quality.shadowsize, quality.offsamples, quality.numslices = 512, 0, 10
    return model


def at(model, beta):
    data = mujoco.MjData(model)
    data.qpos[0] = beta
    mujoco.mj_forward(model, data)
    return data


def set_load(model, load):
    body = model.body("load").id
    model.body_mass[body] *= load
    model.body_inertia[body] *= load
    mujoco.mj_setConst(model, mujoco.MjData(model))


def muscle(length, braid=BRAID, *, fibres=True):
    """Geoms of a muscle along the first axis."""
    drawn = mujoco.MjvScene(mujoco.MjModel.from_xml_string("<mujoco/>"), maxgeom=1000)
    look = length, 3e5, (0.0, 0.0, 1.0), braid
    add_muscle(drawn, np.zeros(3), np.roll(np.eye(3), 1, axis=0), *look, fibres=fibres)
    return list(drawn.geoms[: drawn.ngeom])


def decorated(model, data, *, maxgeom=5000, **state):
    """Geoms added to an empty scene."""
    drawn = mujoco.MjvScene(model, maxgeom=maxgeom)
    decorate(drawn, model, data, **{**STATE, **state})
    return list(drawn.geoms[: drawn.ngeom])


def picture(model, p1, p2, *, beta=0.0):
    lengths = 0.24 - RADIUS * beta, 0.24 + RADIUS * beta
    state = {**STATE, "pressures": (p1, p2), "lengths": lengths}
    return render_arm(model, at(model, beta), **state, camera="top", **SIZE).astype(int)


@pytest.mark.parametrize("name", ["mas20_arm.xml", "scene.xml"])
def test_model_compiles_and_runs_a_second_without_a_warning(name, warnings):
    model = mujoco.MjModel.from_xml_path(str(FOLDER / name))
    data = at(model, 0.9)
    data.qvel[0] = 3.0  # into the limit
    for _ in range(round(1.0 / model.opt.timestep)):
        mujoco.mj_step(model, data)
    assert data.time == pytest.approx(1.0)
    assert warnings == []
    assert sum(warning.number for warning in data.warning) == 0
    assert abs(data.qpos[0]) < LIMIT + 0.05


def test_chain_law_is_exact_and_nothing_touches_over_the_whole_range(model):
    for beta in np.linspace(-LIMIT, LIMIT, 241):
        data = at(model, beta)
        np.testing.assert_array_equal(data.ten_length, [-RADIUS * beta, RADIUS * beta])
        np.testing.assert_array_equal(np.ravel(data.ten_J), [-RADIUS, RADIUS])
        assert data.ncon == 0
    # A positive angle turns the sprocket towards muscle 1.
    assert data.site("muscle_1_anchor").xpos[1] > 0.0
    assert data.body("load").xpos[1] > 0.0
    assert Strand(model, data, 1, 0.24).axes[1, 1] > 0.0


@pytest.mark.parametrize("load", [0.0, 1.2, 2.14])
def test_inertia_and_gravity_torque_follow_load_and_tilt(model, load):
    own = model.body("arm").inertia[2] + 0.45 * 0.125**2
    disc = model.body("load").inertia[2] + 0.25**2
    set_load(model, load)
    assert at(model, 0.3).qfrc_bias[0] == pytest.approx(0.0, abs=1e-12)
    tilt = 0.1
    model.body("rig").quat[:] = math.cos(tilt / 2), math.sin(tilt / 2), 0.0, 0.0
    data = at(model, 0.3)
    mass = np.zeros((1, 1))
    mujoco.mj_fullM(model, data, mass)
    assert mass[0, 0] == pytest.approx(own + load * disc)
    torque = 9.81 * math.sin(tilt) * math.cos(0.3) * (0.45 * 0.125 + load * 0.25)
    assert data.qfrc_bias[0] == pytest.approx(torque)


def test_muscle_keeps_the_length_of_its_fibres_and_its_rubber_between_the_fittings():
    turns = BRAID.nominal_length * math.tan(BRAID.fibre_angle) / (math.pi * BRAID.diameter)
    for length in (0.18, 0.19, 0.225, 0.2499, 0.25, 0.265):
        fibre = math.hypot(length, 2.0 * math.pi * turns * (outer_radius(length, BRAID) - WALL))
        assert fibre == pytest.approx(BRAID.nominal_length / math.cos(BRAID.fibre_angle))
        rounds = [solid for solid in muscle(length) if solid.type == ELLIPSOID]
        reach = [abs(solid.pos[0] - length / 2) + solid.size[2] for solid in rounds]
        assert max(reach, default=0.0) < length / 2 + 0.023


def test_each_muscle_is_drawn_in_its_own_size():
    """A muscle of half the MAS-20's diameter and its own length, beside the law of its fibres."""
    slim = dataclasses.replace(BRAID, nominal_length=0.12, diameter=0.010)
    tubes = [muscle(braid.nominal_length, braid, fibres=False) for braid in (BRAID, slim)]
    for one, other in zip(*tubes, strict=True):
        assert other.size[0] == pytest.approx(0.5 * one.size[0])
    assert outer_radius(0.12, slim) == pytest.approx(0.5 * outer_radius(0.25, BRAID))
    assert outer_radius(0.09, slim) > outer_radius(0.12, slim)
    # The fibres of the slim one are too short for a MAS-20's length.
    for length, braid in (
        (0.0, BRAID),
        (-0.1, BRAID),
        (0.29, BRAID),
        (math.nan, BRAID),
        (0.25, slim),
    ):
        with pytest.raises(InputError, match="muscle length"):
            outer_radius(length, braid)


@pytest.mark.parametrize("number", [1, 2])
@pytest.mark.parametrize("sprocket", [0.009, 0.0125, 0.02])
def test_chain_runs_smoothly_from_the_sprocket_to_the_muscle(model, number, sprocket):
    model.wrap_prm[:] = -sprocket, sprocket
    data = at(model, 0.5)
    strand = Strand(model, data, number, 0.23)
    path = np.linspace(0.0, strand.breaks[3], 2001)
    points = strand.points(path)
    speed = np.linalg.norm(np.diff(points, axis=0), axis=1) / np.diff(path)
    np.testing.assert_allclose(speed, 1.0, rtol=1e-4)
    anchor = data.site(f"muscle_{number}_anchor")
    moving_end = anchor.xpos + (0.23 + MOVING_REACH) * anchor.xmat.reshape(3, 3)[:, 2]
    np.testing.assert_allclose(points[-1], moving_end, atol=1e-12)
    hub = data.site("sprocket").xpos
    assert np.linalg.norm(points - hub, axis=1).min() == pytest.approx(sprocket)


@needs_gl
def test_pressure_gives_its_own_muscle_the_colour_of_its_curve(scene):
    vented = picture(scene, 0.0, 0.0)
    assert vented.std() > 20.0
    for number, warm in enumerate((picture(scene, 6e5, 0.0), picture(scene, 0.0, 6e5))):
        rows, columns = np.nonzero(np.abs(warm - vented).sum(axis=2) > 60)
        assert len(rows) > 200
        half = SIZE["height"] // 2  # seen from above, muscle 1 lies in the upper half
        assert (rows < half).all() if number == 0 else (rows >= half).all()
        assert nearest_series((warm - vented)[rows, columns].mean(axis=0)) == number


@needs_gl
def test_moving_end_follows_the_length(scene):
    """Seen from above, the pressurised muscle's coloured length shrinks as it should."""
    widths = []
    for beta in (-0.8, 0.8):
        warm, vented = picture(scene, 6e5, 0.0, beta=beta), picture(scene, 0.0, 0.0, beta=beta)
        columns = np.nonzero(np.abs(warm - vented).sum(axis=2) > 60)[1]
        widths.append(columns.max() - columns.min())
    assert widths[0] / widths[1] == pytest.approx(0.25 / 0.23, abs=0.03)


@needs_gl
def test_renderer_can_be_used_again_and_leaves_the_model_as_it_was(model):
    before = model.vis.global_.offwidth
    data = at(model, 0.1)
    renderer = open_renderer(model, width=before + 80, height=100)
    try:
        first, second = (render_arm(model, data, **STATE, renderer=renderer) for _ in range(2))
    finally:
        renderer.close()
    assert first.shape == (100, before + 80, 3)
    assert first.dtype == np.uint8
    np.testing.assert_array_equal(first, second)
    assert model.vis.global_.offwidth == before


@pytest.mark.parametrize(("load", "discs"), [(0.0, 0), (1.2, 2), (2.14, 4)])
def test_load_is_drawn_by_its_weight(model, load, discs):
    set_load(model, load)
    data, drawn = at(model, 0.0), mujoco.MjvScene(model, maxgeom=5000)
    look, every = (mujoco.MjvOption(), None, mujoco.MjvCamera()), mujoco.mjtCatBit.mjCAT_ALL.value
    mujoco.mjv_updateScene(model, data, *look, every, drawn)
    own = drawn.ngeom
    decorate(drawn, model, data, **STATE)
    radius = model.site("load_seat").size[0]
    wide = [g for g in drawn.geoms[own : drawn.ngeom] if g.size[0] == pytest.approx(radius)]
    assert len(wide) == discs
    iron = 7300.0 * math.pi * radius**2 * sum(2.0 * g.size[2] for g in wide)
    assert iron == pytest.approx(load, rel=0.1)  # short by the gaps between the discs


@pytest.mark.parametrize(("width", "height"), [(1600, 1000), (480, 480), (300, 900), (1200, 400)])
def test_a_picture_shows_at_least_what_the_scene_is_composed_for(width, height):
    model = pamsim.load_rig("mas20_arm", scene=True).model
    composed = np.tan(np.radians(model.cam_fovy) / 2.0)
    show_whole(model, width=width, height=height)
    up = np.tan(np.radians(model.cam_fovy) / 2.0)
    assert np.all(up > composed - 1e-12)
    assert np.all(up * width / height > composed * 1.6 - 1e-12)
    assert np.all(np.isclose(up, composed) | np.isclose(up * width / height, composed * 1.6))


def test_a_quick_picture_has_muscles_and_chain_without_their_fine_parts(model):
    data = at(model, 0.0)
    fine, quick = (len(decorated(model, data, fine=fine)) for fine in (True, False))
    assert 50 < quick < 0.2 * fine


def test_errors_name_what_is_missing(model):
    data = at(model, 0.0)
    with pytest.raises(EngineError, match="full"):
        decorated(model, data, maxgeom=10)
    with pytest.raises(InputError, match="of 2 muscles needs a pressure and a length, got 1 and 2"):
        decorated(model, data, pressures=(0.0,))
    model.wrap_prm[:] = 0.0
    with pytest.raises(EngineError, match="radius 0 m"):
        decorated(model, data)
    half = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><site name="sprocket"/></worldbody></mujoco>'
    )
    with pytest.raises(EngineError, match="joint named 'shaft'"):
        decorated(half, mujoco.MjData(half))
    # Without sites a rig is drawn as its MJCF states.
    bare = mujoco.MjModel.from_xml_string("<mujoco/>")
    assert decorated(bare, mujoco.MjData(bare)) == []


def test_every_muscle_with_an_anchor_is_drawn_along_it():
    rig = pamsim.load_rig("two_joint_arm", scene=True)
    data = mujoco.MjData(rig.model)
    pose(rig.model, data, rig.position_addresses, [0.4, -0.3])
    lengths = muscle_lengths(rig.model, data)
    state = {"muscles": rig.muscles, "pressures": (4e5, 1e5, 3e5, 2e5), "lengths": lengths}
    places = np.array([geom.pos for geom in decorated(rig.model, data, **state)])
    for number, length in enumerate(lengths, start=1):
        anchor = data.site(f"muscle_{number}_anchor").xpos
        own = places[np.abs(places[:, 1] - anchor[1]) < 0.02]
        assert own[:, 0].max() - anchor[0] == pytest.approx(length, abs=0.06)


def test_a_rig_with_slim_muscles_is_drawn_with_them(model):
    rig, data = pamsim.load_rig("mas20_arm"), at(model, 0.0)
    wide, slim = (
        decorated(model, data, muscles=rig.with_parameters({"braid.diameter": d}).muscles)[0]
        for d in (0.020, 0.010)
    )
    assert wide.type == slim.type == mujoco.mjtGeom.mjGEOM_CYLINDER
    assert slim.size[0] == pytest.approx(0.5 * wide.size[0])


def test_without_opengl_one_line_names_the_fix():
    program = f"""
import mujoco
import pamsim
from pamsim.core.errors import EngineError
from pamsim.scene.picture import render_arm
muscles = pamsim.load_rig("mas20_arm").muscles
model = mujoco.MjModel.from_xml_path({str(FOLDER / "mas20_arm.xml")!r})
try:
    render_arm(model, mujoco.MjData(model), muscles=muscles, pressures=(0, 0), lengths=(0.25, 0.25))
except EngineError as error:
    print(error)
"""
    run = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, "MUJOCO_GL": "disable"},
        capture_output=True,
        text=True,
        check=True,
    )
    (line,) = run.stdout.splitlines()
    assert "MUJOCO_GL=egl" in line
    assert "libegl1" in line
