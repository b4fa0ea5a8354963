"""The two-joint arm: virtual work at each joint, names, and cables that run over both joints."""

import shutil

import mujoco
import numpy as np
import pytest

import pamsim
from pamsim.core.errors import InputError
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.state import charge
from pamsim.engine.stepping import live
from pamsim.recordings.experiment import pressure_step
from pamsim.recordings.rig_file import find_rig

ARMS = np.array([[-25e-3, 0.0], [25e-3, 0.0], [-16e-3, -24e-3], [16e-3, 24e-3]])
"""Change of each muscle's length per angle of shoulder and elbow [m/rad], as the README states."""
MIDDLE = [2.5e5] * 4


@pytest.fixture(scope="module")
def rig():
    return pamsim.load_rig("two_joint_arm")


def test_torque_of_each_joint_is_the_sum_of_moment_arms_times_tensions(rig):
    model = rig.model_for()
    data = mujoco.MjData(model)
    draw = np.random.default_rng(3)
    with live(model):
        for _ in range(5):
            data.qpos[:] = draw.uniform(-0.8, 0.8, 2)
            charge(model, data, draw.uniform(0.5e5, 5e5, 4).tolist())
            mujoco.mj_forward(model, data)
            tension = -data.actuator_force
            assert np.all(tension >= 0.0)
            np.testing.assert_allclose(data.qfrc_actuator, -ARMS.T @ tension, atol=1e-12)


def test_signals_carry_the_names_of_joints_and_muscles(rig):
    run = pamsim.simulate(rig, pressure_step(MIDDLE, MIDDLE, duration=0.01))
    assert list(run.joints.items()) == [("shoulder", "angle"), ("elbow", "angle")]
    assert run.signal("elbow.angle").tolist() == run.positions[:, 1].tolist()
    assert run.signal("biceps.pressure").tolist() == run.pressure[:, 2].tolist()
    assert run.signal("triceps.force").tolist() == run.tension[:, 3].tolist()
    assert {"elbow_deg", "biceps_set_kpa", "biceps_kpa", "biceps_n"} <= run.columns().keys()
    assert "elbow 0.00 -> 0.00 deg" in run.summary()
    for asked, words in (
        (lambda: run.signal("elbow.angel"), r"did you mean 'elbow\.angle'"),
        (lambda: run.angle, r"one joint.*shoulder, elbow.*signal\('shoulder.angle'\)"),
        (lambda: rig.only_joint, "needs a rig with one joint"),
    ):
        with pytest.raises(InputError, match=words):
            asked()


def test_without_names_every_joint_that_the_muscles_move_is_recorded(tmp_path, rig):
    folder = shutil.copytree(find_rig("two_joint_arm"), tmp_path / "rig")
    load = '<body name="load" pos="0.25 0 0">'
    for name, before, after in (
        ("params.toml", 'joints = ["shoulder", "elbow"]\n', ""),
        ("two_joint_arm.xml", load, load + '<joint name="wrist"/>'),
    ):
        text = (folder / name).read_text()
        assert before in text
        (folder / name).write_text(text.replace(before, after))
    assert pamsim.load_rig(folder).joints == rig.joints


def test_a_radius_of_a_cable_over_two_joints_is_named_by_its_joint_and_moves_it_alone(rig):
    for name, words in (
        ("tendon.biceps_cable.coef", "differ; write coef_shoulder and coef_elbow"),
        ("tendon.biceps_cable.coef_elbw", "did you mean 'elbow'"),
    ):
        with pytest.raises(InputError, match=words):
            rig.with_parameters({name: 0.02})
    changed = rig.with_parameters({"tendon.biceps_cable.coef_elbow": 0.03})
    assert rig_parameter(changed, "tendon.biceps_cable.coef_elbow").value == 0.03
    assert rig_parameter(changed, "tendon.biceps_cable.coef_shoulder").value == 0.016
    first = changed.model.tendon_adr[changed.model.tendon("biceps_cable").id]
    assert changed.model.wrap_prm[first : first + 2].tolist() == [-0.016, -0.03]
