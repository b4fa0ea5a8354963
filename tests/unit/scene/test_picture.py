"""The shipped rig's MJCF, and pictures of it."""

import dataclasses
import itertools
import math
import os
import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest

import pamsim
from pamsim.core.errors import EngineError
from pamsim.scene.parts import ELLIPSOID, MOVING_REACH, WALL, Strand, add_muscle, outer_radius
from pamsim.scene.picture import decorate, picture_rest, render_arm, show_whole
from pamsim.scene.pose import muscle_lengths, pose
from tests.unit.core.refusals import refused
from tests.unit.scene.films import nearest_series, needs_gl

FOLDER = Path(__file__).parents[3] / "models" / "mas20_arm"
RADIUS = 0.0125
RIG = pamsim.load_rig("mas20_arm")
BRAID = next(iter(RIG.muscles.values())).braided
LIMIT = math.pi / 3
SIZE = {"width": 400, "height": 250}
STATE = {"muscles": RIG.muscles, "pressures": (2e5, 3e5), "lengths": (0.25, 0.25)}


@pytest.fixture
def model():
    return mujoco.MjModel.from_xml_path(str(FOLDER / "mas20_arm.xml"))


@pytest.fixture(scope="module")
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


def test_chain_law_is_exact_and_nothing_touches_over_the_whole_range(model):
    for beta in np.linspace(-LIMIT, LIMIT, 61):
        data = at(model, beta)
        np.testing.assert_array_equal(data.ten_length, [-RADIUS * beta, RADIUS * beta])
        np.testing.assert_array_equal(np.ravel(data.ten_J), [-RADIUS, RADIUS])
        assert data.ncon == 0
    # A positive angle turns the sprocket towards muscle 1.
    assert data.site("muscle_1_anchor").xpos[1] > 0.0
    assert data.body("load").xpos[1] > 0.0
    assert Strand(model, data, 1, 0.24).axes[1, 1] > 0.0


def test_discs_follow_the_load():
    for load, count in ((0.0, 0), (1.2, 2), (2.14, 4)):
        model = mujoco.MjModel.from_xml_path(str(FOLDER / "mas20_arm.xml"))
        set_load(model, load)
        radius = model.site("load_seat").size[0]
        drawn = decorated(model, at(model, 0.3))
        wide = [g for g in drawn if g.size[0] == pytest.approx(radius)]
        assert len(wide) == count
        iron = 7300.0 * math.pi * radius**2 * sum(2.0 * g.size[2] for g in wide)
        assert iron == pytest.approx(load, rel=0.1)  # short by the gaps between the discs


def test_muscle_keeps_the_length_of_its_fibres_and_its_rubber_between_the_fittings():
    turns = BRAID.nominal_length * math.tan(BRAID.fibre_angle) / (math.pi * BRAID.diameter)
    for length in (0.18, 0.19, 0.225, 0.2499, 0.25, 0.265):
        fibre = math.hypot(length, 2.0 * math.pi * turns * (outer_radius(length, BRAID) - WALL))
        assert fibre == pytest.approx(BRAID.nominal_length / math.cos(BRAID.fibre_angle))
        rounds = [solid for solid in muscle(length) if solid.type == ELLIPSOID]
        reach = [abs(solid.pos[0] - length / 2) + solid.size[2] for solid in rounds]
        assert max(reach, default=0.0) < length / 2 + 0.023


def test_each_muscle_is_drawn_in_its_own_size(model):
    """A muscle of half the MAS-20's diameter and its own length, beside the law of its fibres."""
    slim = dataclasses.replace(BRAID, nominal_length=0.12, diameter=0.010)
    tubes = [muscle(braid.nominal_length, braid, fibres=False) for braid in (BRAID, slim)]
    for one, other in zip(*tubes, strict=True):
        assert other.size[0] == pytest.approx(0.5 * one.size[0])
    assert outer_radius(0.12, slim) == pytest.approx(0.5 * outer_radius(0.25, BRAID))
    assert outer_radius(0.09, slim) > outer_radius(0.12, slim)
    # The fibres of the slim one are too short for a MAS-20's length.
    for length, braid in ((0.0, BRAID), (-0.1, BRAID), (0.29, BRAID), (math.nan, BRAID),
                          (0.25, slim)):  # fmt: skip
        with refused("muscle length"):
            outer_radius(length, braid)
    data = at(model, 0.0)
    wide, slim = (
        decorated(model, data, muscles=RIG.with_parameters({"braid.diameter": d}).muscles)[0]
        for d in (0.020, 0.010)
    )
    assert wide.type == slim.type == mujoco.mjtGeom.mjGEOM_CYLINDER
    assert slim.size[0] == pytest.approx(0.5 * wide.size[0])


def test_chain_runs_smoothly_from_the_sprocket_to_the_muscle(model):
    for number, sprocket in itertools.product((1, 2), (0.009, 0.0125, 0.02)):
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
    """Seen from above, where muscle 1 lies in the upper half of the picture."""

    def picture(p1, p2, beta):
        lengths = 0.24 - RADIUS * beta, 0.24 + RADIUS * beta
        state = {**STATE, "pressures": (p1, p2), "lengths": lengths}
        return render_arm(scene, at(scene, beta), **state, camera="top", **SIZE).astype(int)

    for beta, number in ((-0.8, 0), (0.8, 1)):
        vented = picture(0.0, 0.0, beta)
        assert vented.std() > 20.0
        warm = picture(*(6e5, 0.0) if number == 0 else (0.0, 6e5), beta)
        rows, columns = np.nonzero(np.abs(warm - vented).sum(axis=2) > 60)
        assert len(rows) > 200
        assert ((rows >= SIZE["height"] // 2) == number).all()
        assert nearest_series((warm - vented)[rows, columns].mean(axis=0)) == number


def test_a_picture_shows_at_least_what_the_scene_is_composed_for():
    for width, height in ((1600, 1000), (480, 480), (300, 900), (1200, 400)):
        model = pamsim.load_rig("mas20_arm", scene=True).model
        composed = np.tan(np.radians(model.cam_fovy) / 2.0)
        show_whole(model, width=width, height=height)
        up = np.tan(np.radians(model.cam_fovy) / 2.0)
        across = up * width / height
        assert np.all(up > composed - 1e-12)
        assert np.all(across > composed * 1.6 - 1e-12)
        assert np.all(np.isclose(up, composed) | np.isclose(across, composed * 1.6))


def test_a_quick_picture_has_muscles_and_chain_without_their_fine_parts(model):
    data = at(model, 0.0)
    fine, quick = (len(decorated(model, data, fine=fine)) for fine in (True, False))
    assert 50 < quick < 0.2 * fine


def test_errors_name_what_is_missing(model):
    data = at(model, 0.0)
    with refused("full", error=EngineError):
        decorated(model, data, maxgeom=10)
    with refused("of 2 muscles needs a pressure and a length, got 1 and 2"):
        decorated(model, data, pressures=(0.0,))
    model.wrap_prm[:] = 0.0
    with refused("radius 0 m", error=EngineError):
        decorated(model, data)
    half = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><site name="sprocket"/></worldbody></mujoco>'
    )
    with refused("joint named 'shaft'", error=EngineError):
        decorated(half, mujoco.MjData(half))
    # Without sites a rig is drawn as its MJCF states.
    bare = mujoco.MjModel.from_xml_string("<mujoco/>")
    assert decorated(bare, mujoco.MjData(bare)) == []


BARE_ARM = """
<mujoco><worldbody><body pos="0 0 1.2">
  <joint name="elbow" axis="0 -1 0" range="-0.9 0.9"/>
  <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.02"/>
</body></worldbody></mujoco>"""


@needs_gl
@pytest.mark.parametrize("aspect", [0.5, 2.0])
def test_an_own_model_without_a_camera_is_seen_whole_wherever_it_moves(aspect):
    model = mujoco.MjModel.from_xml_string(BARE_ARM)
    size = {"width": round(200 * aspect), "height": 200}
    for beta in (-0.9, 0.0, 0.9):
        state = {"muscles": {}, "pressures": (), "lengths": ()}
        drawn = render_arm(model, at(model, beta), **state, **size).astype(int)
        rows, columns = np.nonzero(np.abs(drawn - drawn[0, 0]).sum(axis=2) > 30)
        assert len(rows) > 200
        assert min(rows.min(), columns.min()) > 0
        assert rows.max() < size["height"] - 1
        assert columns.max() < size["width"] - 1
    with refused("no camera 'top' in this scene"):
        render_arm(model, at(model, 0.0), **state, **size, camera="top")


def test_a_picture_without_pixels_is_refused(tmp_path):
    for width, height in ((0, 10), (40, -5)):
        with refused(f"a picture of {width} x {height} pixels"):
            picture_rest(tmp_path / "arm.png", size=(width, height))


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


def test_without_opengl_one_line_names_the_fix():
    program = """
import mujoco
import pamsim
from pamsim.core.errors import EngineError
from pamsim.scene.picture import render_arm
rig = pamsim.load_rig("mas20_arm")
state = {"muscles": rig.muscles, "pressures": (0, 0), "lengths": (0.25, 0.25)}
try:
    render_arm(rig.model, mujoco.MjData(rig.model), **state)
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
