"""A rig folder to start from: it runs, holds every effect, and its muscles fit their tendons."""

import dataclasses
import re
import tomllib

import mujoco
import numpy as np
import pytest

import pamsim
from pamsim.comparison.effects_on_rig import candidates
from pamsim.core.errors import PamsimError
from pamsim.core.parameters import specs
from pamsim.engine.new_rig import KINDS, new_rig
from pamsim.physics.hysteresis.bouc_wen import BoucWen
from pamsim.physics.muscle import plain_groups

SPATIAL = """
<mujoco>
  <worldbody>
    <site name="top" pos="0.05 0 0.4"/>
    <body name="frame">
      <body>
        <joint name="knee" axis="0 1 0" range="-40 40"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.02" mass="0.5"/>
        <site name="hook" pos="0.04 0 -0.03"/>
      </body>
    </body>
  </worldbody>
  <tendon>
    <spatial name="extensor_tendon"><site site="top"/><site site="hook"/></spatial>
    <fixed name="flexor"><joint joint="knee" coef="0.02"/></fixed>
  </tendon>
</mujoco>
"""


@pytest.fixture
def own(tmp_path):
    path = tmp_path / "knee.xml"
    path.write_text(SPATIAL)
    return path


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "bellows"])
def test_a_template_runs_and_every_effect_can_be_tried_on_it(kind, tmp_path):
    rig = pamsim.load_rig(new_rig("mine", kind, out=tmp_path / "mine"))
    count = len(rig.muscles)
    step = pamsim.pressure_step([2e5] * count, [3e5] + [1e5] * (count - 1), duration=0.5, load=0.5)
    run = pamsim.simulate(rig, step).completed()
    assert np.ptp(run.positions[:, 0]) > 0.01  # rad, m
    assert np.all(run.tension >= 0.0)
    _, skipped = candidates(rig)
    pairs = {"muscle_mismatch", "valve_mismatch"}
    assert set(skipped) == (pairs if kind == "bench" else set())


def pushed(rig):
    """Where a joint goes as the first bellows gets more pressure than the others [rad, m]."""
    count = len(rig.muscles)
    step = pamsim.pressure_step([3e4] * count, [8e4] + [2e4] * (count - 1), duration=1.0)
    run = pamsim.simulate(rig, step).completed()
    assert run.tension[-1, 0] < 0.0, "bellows push"
    return run.positions[-1, 0] - run.positions[0, 0]


def test_bellows_push_their_joint_and_what_needs_a_braid_is_left_out(tmp_path):
    rig = pamsim.load_rig(new_rig("mine", "bellows", out=tmp_path / "mine"))
    assert 0.1 < pushed(rig) < 0.5
    _, skipped = candidates(rig)
    assert set(skipped) == {
        "braid_friction", "threshold_pressure", "passive_stiffness", "end_shape",
        "chain_backlash", "chain_compliance", "sprocket_ripple",
    }  # fmt: skip
    data = mujoco.MjData(rig.model)
    for angle in rig.model.joint("elbow").range:
        data.qpos[0] = angle
        mujoco.mj_forward(rig.model, data)
        strokes = [m.mounting.length_at_zero for m in rig.muscles.values()] + data.ten_length
        free = [m.stroke.nominal_length for m in rig.muscles.values()]
        assert sorted(strokes / free) == pytest.approx([0.5, 1.5])


def test_bellows_on_the_tendons_of_an_mjcf(own, tmp_path):
    own.write_text(SPATIAL.replace("-40 40", "-20 60"))
    rig = pamsim.load_rig(new_rig("my_knee", mjcf=own, pushing=True, out=tmp_path / "rig"))
    assert all(muscle.pushes for muscle in rig.muscles.values())
    extensor = rig.muscles["extensor"]
    assert extensor.mounting.length_at_zero == 0.0  # a spatial tendon, from pin to pin
    flexor = rig.muscles["flexor"]
    ends = flexor.mounting.length_at_zero + 0.02 * rig.model.joint("knee").range
    assert ends / flexor.stroke.nominal_length == pytest.approx([0.5, 1.5], rel=1e-4)
    assert pushed(rig) != 0.0
    with pytest.raises(PamsimError, match="a kind that pushes is bellows"):
        new_rig("mine", "joint", pushing=True, out=tmp_path / "mine")


def test_every_field_is_there_and_what_has_a_neutral_value_has_it(tmp_path):
    folder = new_rig("mine", "joint", out=tmp_path / "mine")
    table = tomllib.loads((folder / "params.toml").read_text())
    shared, own = table["muscle"], table["muscles"]["flexor"]
    muscle = pamsim.load_rig(folder).muscles["flexor"]
    for group in (*plain_groups(False), BoucWen):
        defaults = {field.name: field.default for field in dataclasses.fields(group)}
        for name, _ in specs(group):
            stated = {**shared.get(group.group, {}), **own.get(group.group, {})}[name]
            assert stated["source"].startswith("assumed: ")
            if stated["source"] in ("assumed: off", "assumed: usual"):
                value = getattr(getattr(muscle, group.group), name)
                assert value == pytest.approx(defaults[name], rel=1e-6), name


def test_muscles_of_an_mjcf_work_between_no_contraction_and_a_quarter(own, tmp_path):
    rig = pamsim.load_rig(new_rig("my_knee", mjcf=own, out=tmp_path / "rig"))
    assert list(rig.muscles) == ["extensor", "flexor"]
    data = mujoco.MjData(rig.model)
    contraction = []
    for angle in np.linspace(*rig.model.jnt_range[0], 81):
        data.qpos[0] = angle
        mujoco.mj_kinematics(rig.model, data)
        mujoco.mj_comPos(rig.model, data)
        mujoco.mj_tendon(rig.model, data)
        lengths = [m.mounting.length_at_zero for m in rig.muscles.values()] + data.ten_length
        contraction.append(1.0 - lengths / [m.braid.nominal_length for m in rig.muscles.values()])
    least, most = np.min(contraction, axis=0), np.max(contraction, axis=0)
    assert least == pytest.approx(0.0, abs=1e-4)
    assert np.all((most > 0.2) & (most <= 0.25 + 1e-4))
    # A cable of the rest: the muscle on the spatial tendon is not longer than the tendon.
    assert rig.muscles["extensor"].mounting.length_at_zero < 0.0
    text = (rig.file.folder / "params.toml").read_text(encoding="utf-8")
    stated = re.findall(r"assumed: (\d+) % contracted where its tendon is shortest", text)
    assert [*map(float, stated)] == pytest.approx(100.0 * most, abs=0.5)
    assert rig.model.joint("knee").damping[0] > 0.0
    assert (tmp_path / "rig" / "knee.xml").read_text() == SPATIAL


@pytest.mark.parametrize("other", ["flexor_cable", "flexor_tendon", "_cable", "bück_cable"])
def test_every_muscle_of_an_mjcf_has_a_name_of_its_own(other, own, tmp_path):
    own.write_text(SPATIAL.replace("extensor_tendon", other), encoding="utf-8")
    rig = pamsim.load_rig(new_rig("my_knee", mjcf=own, out=tmp_path / "rig"))
    kept = other if other.startswith(("flexor", "_")) else "bück"
    assert rig.file.tendons == {kept: other, "flexor": "flexor"}


def test_an_mjcf_in_the_folder_stays_as_it_is_and_nothing_is_replaced_unasked(own, tmp_path):
    new_rig("my_knee", mjcf=own, out=tmp_path)
    assert own.read_text() == SPATIAL
    with pytest.raises(PamsimError, match=r"params\.toml is there already"):
        new_rig("my_knee", mjcf=own, out=tmp_path)
    (tmp_path / "params.toml").write_text("")
    assert pamsim.load_rig(new_rig("my_knee", mjcf=own, out=tmp_path, force=True)).muscles


TENDONS = SPATIAL[SPATIAL.index("  <tendon>") : SPATIAL.index("</mujoco>")]


def test_what_makes_no_rig_is_refused_and_leaves_nothing(own, tmp_path):
    for old, new, why in (
        (TENDONS, "", "no tendon"),
        ("</mujoco>", '<actuator><motor joint="knee"/></actuator></mujoco>', "remove <actuator>"),
        ('name="flexor"', 'name="a flexor"', "is no name"),
        ("<worldbody>", '<option integrator="RK4"/><worldbody>', "RK4"),
        ('axis="0 1 0"', 'axis="0 0 0"', "axis"),
        ("<worldbody>", '<!-- file = "knee.stl" --><worldbody>', "give its own folder"),
    ):
        assert old in SPATIAL
        own.write_text(SPATIAL.replace(old, new))
        with pytest.raises(PamsimError, match=why):
            new_rig("my_knee", mjcf=own, out=tmp_path / "rig")
    for arguments, why in (
        ({"name": "a b", "kind": "joint"}, "no name"),
        ({"name": "a"}, "`kind`"),
        ({"name": "a", "kind": "join"}, "did you mean 'joint'"),
        ({"name": "a", "mjcf": "none.xml"}, "no MJCF"),
    ):
        with pytest.raises(PamsimError, match=why):
            new_rig(**arguments, out=tmp_path / "rig")
    assert not list((tmp_path / "rig").glob("*"))
