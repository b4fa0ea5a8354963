"""Rigs in the engine: parameters arrive where the solver reads them, and only there."""

import copy
import dataclasses
import math
import re
import shutil

import mujoco
import numpy as np
import pytest

import pamsim
from pamsim.core.errors import InputError, ParameterError
from pamsim.engine.mjcf_fields import native_names, native_value, set_natives
from pamsim.engine.parameters import rig_parameter
from pamsim.physics.hysteresis.maxwell_slip import MaxwellSlip
from pamsim.physics.record import slot, unpack
from pamsim.recordings.rig_file import shipped_rigs


def test_parameters_arrive_in_the_model_and_changed_ones_leave_the_original_alone(rig):
    native = rig.file.native
    assert rig.model.joint("shaft").damping[0] == native["joint.shaft.damping"].value
    for i, muscle in enumerate(rig.muscles.values()):
        assert unpack(rig.model.actuator_user[i]) == muscle
    radius = abs(rig.model.wrap_prm[rig.model.tendon("chain_1").id])
    assert radius == pytest.approx(native["tendon.chain_1.coef"].si("m"))
    stiffness = slot("passive.stiffness")
    before = rig.model.actuator_user.copy()
    changed = rig.with_parameters(
        {"muscle_2:passive.stiffness": 1.0, "joint.shaft.damping": 9.0, "tendon.chain_1.coef": 0.02}
    )
    assert np.array_equal(rig.model.actuator_user, before)
    assert changed.model.actuator_user[1, stiffness] == 1.0
    assert changed.model.actuator_user[0, stiffness] == before[0, stiffness]
    assert changed.muscles["muscle_2"].passive.stiffness == 1.0
    assert changed.model.joint("shaft").damping[0] == 9.0
    data = mujoco.MjData(changed.model)
    data.qpos[0] = 0.1
    mujoco.mj_fwdPosition(changed.model, data)
    np.testing.assert_allclose(data.actuator_length[0], -0.002, rtol=1e-12)
    # One muscle's own value counts in either order.
    values = {"valve.conductance_fill": 4e-10, "muscle_2:valve.conductance_fill": 3e-10}
    for order in (values, dict(reversed(values.items()))):
        found = [m.valve.conductance_fill for m in rig.with_parameters(order).muscles.values()]
        assert found == [4e-10, 3e-10]


def test_a_parameter_of_another_operator_brings_the_operator(rig):
    """All else stays as it is, changes to the loaded rig included."""
    own = rig.with_parameters(
        {
            "passive.stiffness": 9e3,
            "joint.shaft.damping": 0.5,
            "hysteresis.force_per_pressure": 7e-5,
        }
    )
    slipping = own.with_parameters({"hysteresis.maxwell_slip.full_slip": 0.02})
    for name, muscle in slipping.muscles.items():
        loop = muscle.hysteresis
        assert (loop.law, loop.full_slip, loop.force_per_pressure) == ("maxwell_slip", 0.02, 7e-5)
        assert (
            dataclasses.replace(muscle, hysteresis=own.muscles[name].hysteresis)
            == (own.muscles[name])
        )
    assert slipping.model.joint("shaft").damping[0] == 0.5
    assert slipping.model.body_quat == pytest.approx(own.model.body_quat)
    assert slipping.file.muscle["hysteresis"]["law"] == "maxwell_slip"
    one = own.with_parameters({"muscle_1:hysteresis.maxwell_slip.full_slip": 0.02}).muscles
    assert [muscle.hysteresis.full_slip for muscle in one.values()] == [0.02, 0.01]
    more = int(slipping.muscles["muscle_1"].hysteresis.elements) - 1
    assert slipping.model.na == rig.model.na + 2 * more
    back = slipping.with_operator("bouc_wen")
    assert back.muscles["muscle_1"].hysteresis.yield_contraction == 5e-3
    found = rig_parameter(rig, "hysteresis.maxwell_slip.full_slip")
    assert (found.name, found.value) == ("hysteresis.maxwell_slip.full_slip", 0.01)
    for names in (
        ["hysteresis.preisach.levels"],
        ["hysteresis.maxwell_slip.full_slip", "hysteresis.bouc_wen.sigma"],
    ):
        with pytest.raises(InputError, match="operator"):
            rig.with_parameters(dict.fromkeys(names, 1.0))


def test_sensors_are_parameters_like_any_other(rig):
    changed = rig.with_parameters({"sensor.angle_bias": 0.02, "sensor.pressure_lag": 0.01})
    assert (changed.sensor.angle_bias, changed.sensor.pressure_lag) == (0.02, 0.01)
    assert changed.sensor.encoder_increments == rig.sensor.encoder_increments == 2500.0
    assert rig.sensor.angle_bias == 0.0
    again = changed.with_parameters({"passive.stiffness": 1e4})
    assert again.sensor == changed.sensor
    blind = dataclasses.replace(rig, sensor=None).with_parameters({"sensor.angle_scale": 1.1})
    assert (blind.sensor.angle_scale, blind.sensor.pressure_step) == (1.1, 0.0)
    found = rig_parameter(changed, "sensor.angle_bias")
    assert (found.value, found.spec.unit, found.stated) == (0.02, "rad", None)
    assert rig_parameter(rig, "sensor.converter_bits").stated is not None
    with pytest.raises(InputError, match="did you mean 'angle_bias'"):
        rig_parameter(rig, "sensor.angle_bais")


def test_an_operator_with_more_elements_is_that_of_a_rig_made_with_them(rig, monkeypatch):
    parallel = {"hysteresis.force": 10.0, "creep.stiffness": 3e3, "creep.relaxation_time": 0.2}
    slipping = rig.with_parameters({"hysteresis.maxwell_slip.full_slip": 0.01, **parallel})
    step = pamsim.pressure_step((3e5, 3e5), (3e5, 1e5), duration=0.2)
    for count in (3.0, 20.0):
        usual = {**MaxwellSlip.usual, "elements": count}
        monkeypatch.setattr(MaxwellSlip, "usual", usual)
        made = rig.with_parameters({"hysteresis.maxwell_slip.full_slip": 0.01, **parallel})
        changed = slipping.with_parameters({"hysteresis.elements": count})
        one, other = (pamsim.simulate(each, step).completed() for each in (made, changed))
        assert np.array_equal(one.angle, other.angle)
        assert np.array_equal(made.model.dof_damping, changed.model.dof_damping)


def test_what_is_only_seen_stays_with_another_operator_or_another_number_of_elements():
    seen = pamsim.load_rig("mas20_arm", scene=True)
    slipping = seen.with_parameters({"hysteresis.maxwell_slip.full_slip": 0.01})
    more = slipping.with_parameters({"hysteresis.elements": 20})
    assert slipping.model.ngeom == more.model.ngeom == seen.model.ngeom > 0


def test_dry_friction_sticks_again_without_a_friction_speed_whatever_operator_follows(rig):
    smooth = rig.with_parameters({"joint.shaft.friction_speed": 0.1, "joint.shaft.frictionloss": 1})
    assert smooth.model.opt.noslip_iterations == 0
    again = smooth.with_parameters({"joint.shaft.friction_speed": 0.0})
    other = again.with_parameters({"hysteresis.maxwell_slip.full_slip": 0.01})
    assert other.model.opt.noslip_iterations == again.model.opt.noslip_iterations > 0


def test_a_body_that_is_turned_about_another_axis_has_no_tilt(tmp_path):
    folder = shutil.copytree(shipped_rigs() / "mas20_arm", tmp_path / "rig")
    mjcf = folder / "mas20_arm.xml"
    text = mjcf.read_text(encoding="utf-8")
    mjcf.write_text(text.replace('<body name="rig"', '<body name="rig" euler="0 0.7 0"', 1))
    with pytest.raises(
        InputError, match=r"body\.rig\.tilt: the MJCF turns this body about another"
    ):
        pamsim.load_rig(folder)


@pytest.mark.parametrize(("turned", "tilt"), [("180", 180.0), ("190", -170.0), ("-350", 10.0)])
def test_a_tilt_is_the_shortest_turn_that_gives_the_body_its_place(turned, tilt):
    text = f'<body name="frame" axisangle="1 0 0 {turned}"><geom size="1"/></body>'
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{text}</worldbody></mujoco>")
    assert np.degrees(native_value(model, "body.frame.tilt")) == pytest.approx(tilt)


def test_two_actuators_on_one_sliding_joint_share_its_load(tmp_path):
    folder = shutil.copytree(shipped_rigs() / "muscle_bench", tmp_path / "rig")
    file = folder / "params.toml"
    text = file.read_text(encoding="utf-8")
    both = "left = { joint = 'rod' }\nright = { joint = 'rod' }"
    file.write_text(text.replace('muscle = { tendon = "line" }', both), encoding="utf-8")
    hold = dataclasses.replace(pamsim.pressure_step((1e5, 1e5), (1e5, 1e5), duration=0.1), settle=8)
    pulls = [
        pamsim.simulate(folder, dataclasses.replace(hold, load=load)).completed().tension[-1]
        for load in (1.0, 3.0)
    ]
    assert pulls[0][0] == pulls[0][1]
    assert pulls[1] - pulls[0] == pytest.approx(2.0 * 9.81 / 2.0, rel=1e-3)


def test_bad_parameters_are_refused_by_name(rig):
    for name, value, error, words in (
        ("passive.stifness", 1.0, InputError, "did you mean 'passive.stiffness'"),
        ("muscle_3:passive.stiffness", 1.0, InputError, "no muscle 'muscle_3'"),
        ("passive.stiffness", -1.0, ParameterError, r"passive.stiffness = -1 is outside \[0, "),
        ("joint.shaft.damping", -1.0, ParameterError, "joint.shaft.damping = -1"),
        ("sensor.angle_bais", 0.1, InputError, "did you mean 'angle_bias'"),
        ("sensor.angle_scale", 0.0, ParameterError, "sensor.angle_scale = 0 is outside"),
        ("joint.shaft.damping", math.nan, ParameterError, "finite number"),
        ("body.load.mass", 1.0, InputError, "this body is the load; state `load`"),
    ):
        with pytest.raises(error, match=words):
            rig.with_parameters({name: value})
    for value in (True, "abc", None):
        with pytest.raises(ParameterError, match=f"passive.stiffness = {value!r} is not a number"):
            rig.with_parameters({"passive.stiffness": value})
    for command in (("valve",), ("valve", "pulse", "valve"), ()):
        with pytest.raises(InputError, match=f"{len(command)} commands for 2 muscles; give one"):
            rig.model_for(command=command)
    for name, words in (("joint.shaft.colour", "no native"), ("body.amr.mass", "no body 'amr'")):
        with pytest.raises(InputError, match=words):
            set_natives(rig.model_for(), {name: 1.0}, rig.compiled)


def test_a_spatial_tendon_has_no_radius():
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><worldbody><site name="a"/><body><joint/><geom size="0.1"/>
        <site name="b" pos="0 0 1"/></body></worldbody>
        <tendon><spatial name="cord"><site site="a"/><site site="b"/></spatial></tendon></mujoco>"""
    )
    assert "tendon.cord.damping" in native_names(model)
    assert "tendon.cord.coef" not in native_names(model)
    with pytest.raises(InputError, match=r"tendon\.cord\.coef: the tendon runs over no joint"):
        native_value(model, "tendon.cord.coef")


def test_mass_scales_the_inertia_of_its_body_and_back_from_none(rig):
    model = rig.model_for()
    arm = model.body("arm").id
    before = model.body_inertia[arm].copy()
    set_natives(model, {"body.arm.mass": 2.0 * model.body_mass[arm]}, rig.compiled)
    np.testing.assert_allclose(model.body_inertia[arm], 2.0 * before)
    load = rig.model.body("load").id
    for kg in (0.0, 1.0, 2.0):
        set_natives(model, {"body.load.mass": kg}, rig.compiled)
        expected = kg * rig.compiled.body_inertia[load] / rig.compiled.body_mass[load]
        np.testing.assert_allclose(model.body_inertia[load], expected, rtol=1e-12)
        assert np.isfinite(model.dof_M0).all()


def test_a_body_whose_mjcf_gives_no_mass_takes_none(rig):
    bare = copy.copy(rig.compiled)
    bare.body_mass[bare.body("load").id] = 0.0
    massless = dataclasses.replace(rig, compiled=bare)
    with pytest.raises(InputError, match="gives this body no mass"):
        set_natives(massless.model_for(), {"body.load.mass": 1.0}, bare)
    with pytest.raises(InputError, match=r"rig\.load_body = 'load' .* gives this body no mass"):
        massless.model_for(load=1.0)
    massless.model_for()


def test_an_mjcf_in_another_encoding_is_refused_with_its_line(tmp_path):
    shutil.copytree(shipped_rigs() / "mas20_arm", tmp_path / "rig")
    mjcf = tmp_path / "rig" / "mas20_arm.xml"
    text = mjcf.read_bytes().replace(b'name="shaft"', b'name="sh\xedft"', 1)
    mjcf.write_bytes(text)
    line = text[: text.index(b"\xed")].count(b"\n") + 1
    with pytest.raises(InputError, match=rf"mas20_arm\.xml: line {line} is not UTF-8; save"):
        pamsim.load_rig(tmp_path / "rig")


def test_a_rig_that_cannot_be_meant_is_refused(tmp_path):
    arm, step = "mas20_arm.xml", 'timestep="0.0005"'
    for number, (file, old, new, why) in enumerate(
        (
            (arm, step, 'timestep="0"', "timestep = 0; write one such as"),
            (arm, step, 'timestep="nan"', "<option> timestep='nan' is no number"),
            (arm, "<option ", '<option actuatorgroupdisable="0" ', "muscles do not act"),
            (arm, "<flag ", '<flag actuation="disable" ', "muscles do not act"),
            (
                "params.toml",
                '"chain_2" }',
                '"chain_1" }',
                "tendon 'chain_1' has 'muscle_1'",
            ),
            ("params.toml", 'value = 20, unit = "mm"', 'value = 1e-12, unit = "mm"', "diameter"),
        )
    ):
        folder = shutil.copytree(shipped_rigs() / "mas20_arm", tmp_path / str(number))
        text = (folder / file).read_text(encoding="utf-8")
        assert old in text
        (folder / file).write_text(text.replace(old, new, 1), encoding="utf-8")
        with pytest.raises((InputError, ParameterError), match=re.escape(why)):
            pamsim.load_rig(folder)
