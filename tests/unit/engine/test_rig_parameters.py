"""The parameters of a rig: all that its file states, each settable by its name."""

import mujoco
import numpy as np
import pytest

from pamsim.comparison.readable_unit import readable_unit
from pamsim.core.parameters import Sourced
from pamsim.engine.new_rig import new_rig
from pamsim.engine.parameters import each_muscle, rig_parameter, rig_parameters
from pamsim.engine.rig import load_rig
from pamsim.engine.rig_cards import parameter_cards, rig_cards
from pamsim.recordings.rig_file import shipped_rig_names

RIGS = shipped_rig_names()

CONVERTER = ("sensor.converter_bits", "sensor.converter_span", "sensor.transducer_gain")
"""They are stated together, or none of them."""


@pytest.mark.parametrize("name", RIGS)
def test_every_parameter_can_be_set_and_keeps_its_value(name):
    rig = load_rig(name)
    listed = list(rig_parameters(rig))
    again = rig.with_parameters({one.name: one.value for one in listed})
    assert [one.name for one in listed] == [one.name for one in rig_parameters(again)]
    for one in listed:
        assert rig_parameter(again, one.name).value == pytest.approx(one.value, rel=1e-12)
        changed = one.value + 1e-3 * (one.spec.high - one.value)
        alone = one.name not in CONVERTER
        if alone and one.spec.low <= changed < one.spec.high:
            other = rig_parameter(rig.with_parameters({one.name: changed}), one.name).value
            assert other == pytest.approx(changed, rel=1e-9), one.name


@pytest.mark.parametrize("name", RIGS)
def test_every_number_of_the_file_is_listed_with_its_source(name):
    rig = load_rig(name)
    listed = {one.name: one for one in rig_parameters(rig)}
    sections = {f"{group}.": numbers for group, numbers in rig.file.muscle.items()}
    for muscle, groups in rig.file.overrides.items():
        sections |= {f"{muscle}:{group}.": numbers for group, numbers in groups.items()}
    stated = {**rig.file.native, **{f"sensor.{n}": v for n, v in rig.file.sensor.items()}}
    stated |= {
        f"{section}{field}": number
        for section, numbers in sections.items()
        for field, number in numbers.items()
        if isinstance(number, Sourced)
    }
    assert len(stated) > 10
    for key, number in stated.items():
        common = key.rpartition(":")[2]
        found = listed.get(key) or listed.get(common) or rig_parameter(rig, key)
        assert found.stated == number or any(o.stated == number for o in listed.values()), key


def test_errors_of_the_sensor_of_a_joint_that_slides_are_lengths(tmp_path):
    folder = new_rig("mine", "bench", out=tmp_path / "mine")
    params = folder / "params.toml"
    text = params.read_text(encoding="utf-8")
    assert 'angle_backlash = { value = 0, unit = "mm"' in text
    text = text.replace("angle_bias = { value = 0,", "angle_bias = { value = 2,")
    params.write_text(text, encoding="utf-8")
    found = rig_parameter(load_rig(folder), "sensor.angle_bias")
    assert (found.value, found.spec.unit, readable_unit(found)) == (pytest.approx(2e-3), "m", "mm")
    assert rig_parameter(load_rig("muscle_bench"), "sensor.angle_bend").spec.unit == "1/m"
    assert rig_parameter(load_rig("mas20_arm"), "sensor.angle_bias").spec.unit == "rad"


def test_a_number_that_differs_from_muscle_to_muscle_is_listed_for_each():
    rig = load_rig("mas20_arm").with_parameters({"muscle_2:force.scale": 0.9})
    names = [one.name for one in rig_parameters(rig)]
    assert {"muscle_1:force.scale", "muscle_2:force.scale"} <= set(names)
    assert "force.scale" not in names
    assert "body.load.mass" not in names  # an experiment states it
    assert "force.a" in names


def test_a_shared_number_in_which_muscles_differ_moves_in_each_by_the_same_share():
    rig = load_rig("mas20_arm").with_parameters(
        {"muscle_2:force.scale": 0.9, "muscle_2:chain.compliance": 1e-6}
    )
    shared = {"force.scale": 1.1, "passive.locking": 25.0, "chain.compliance": 2e-6}
    found = each_muscle(rig, {"muscle_1:valve.delay": 0.01, **shared})
    assert found == {
        "muscle_1:force.scale": pytest.approx(1.1),
        "muscle_2:force.scale": pytest.approx(0.99),
        "passive.locking": 25.0,
        "muscle_1:chain.compliance": 2e-6,  # 0 has no share
        "muscle_2:chain.compliance": pytest.approx(3e-6),
        "muscle_1:valve.delay": 0.01,
    }
    mismatch = {"muscle_2:force.scale": 0.8}
    assert each_muscle(rig, {**shared, **mismatch})["muscle_2:force.scale"] == 0.8
    own = {name: rig_parameter(rig, name).value for name in shared}
    unmoved = rig.with_parameters(each_muscle(rig, own))
    assert np.array_equal(unmoved.model.actuator_user, rig.model.actuator_user)


def test_cards_of_rigs_and_parameters_state_what_each_is():
    for card in rig_cards()["rigs"]:
        rig = load_rig(card["name"])
        assert card["purpose"]
        assert [one["name"] for one in card["muscles"]] == list(rig.muscles)
        assert {one["name"]: one["kind"] for one in card["joints"]} == dict(rig.joints)
        moves = set(card["drives"]["joints"])
        assert ("angle" in moves) == ("angle" in rig.joints.values())
        assert ("length" in moves) == ("position" in rig.joints.values())
    (card,) = parameter_cards("passive.locking")["parameters"]
    stated = load_rig("mas20_arm").file.muscle["passive"]["locking"]
    assert card["source"] == stated.source == "identified"
    assert card["stated"]["interval95"] == list(stated.interval95)
    assert card["low"] < card["value"] < card["high"]
    assert parameter_cards("joint.shaft.armature")["parameters"][0]["source"] == "mas20_arm.xml"


def saved(model, path):
    mujoco.mj_saveModel(model, str(path))
    return path.read_bytes()


@pytest.mark.parametrize("rig", ["mas20_arm", "two_joint_arm"])
def test_no_constant_of_the_model_is_stale_after_any_parameter(rig, tmp_path):
    """`with_parameters` leaves `mj_setConst` out after fields from which no constant follows."""
    own = load_rig(rig)
    for one in rig_parameters(own):
        if one.name in CONVERTER:
            continue
        value = one.value + 1e-3 * (one.spec.high - one.value)
        changed = own.with_parameters({one.name: value}).model
        stale = saved(changed, tmp_path / "model.mjb")
        mujoco.mj_setConst(changed, mujoco.MjData(changed))
        assert saved(changed, tmp_path / "model.mjb") == stale, one.name
