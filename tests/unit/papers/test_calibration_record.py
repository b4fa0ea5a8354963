"""The record of a rig's calibration: what belongs to it is used, what is damaged is refused."""

from __future__ import annotations

import copy
import json
from types import SimpleNamespace

import pytest

from pamsim.engine.rig import load_rig
from pamsim.engine.rig_parameter import rig_parameter
from pamsim.papers.calibration_record import (
    FILE,
    SAME_RMS_DEG,
    SCHEMA,
    calibration_record,
    identified_parameters,
    stated_parameters,
)
from tests.unit.core.refusals import cases, refused


def model(name, accepted, rms, unseen):
    return {
        "name": name,
        "accepted": accepted,
        "rms_deg": rms,
        "leave_one_out_rms_deg": unseen,
        "parameters": [],
    }


WHOLE = {
    "schema": SCHEMA,
    "command": "python calibrate.py",
    "static_models": [
        model("first", True, 8.0, 8.0),
        model("used", True, 0.8, 1.0),
        model("tried", False, 0.7, 1.1),
    ],
}


@pytest.fixture
def rig(tmp_path):
    """Something with a folder, which is all of a rig that is looked at."""
    return SimpleNamespace(file=SimpleNamespace(folder=tmp_path))


def write(rig, content):
    text = content if isinstance(content, str) else json.dumps(content)
    (rig.file.folder / FILE).write_text(text, encoding="utf-8")


def test_a_rig_need_not_have_one(rig):
    assert calibration_record(rig) is None


def test_the_model_used_is_the_last_one_accepted(rig):
    write(rig, {**WHOLE, "future": 1})
    record = calibration_record(rig)
    assert record.used["name"] == "used"
    assert record.command == "python calibrate.py"
    assert [entry["name"] for entry in record.static_models] == ["first", "used", "tried"]


def test_it_belongs_to_what_simulates_as_it_did(rig):
    write(rig, WHOLE)
    record = calibration_record(rig)
    for sign in (-1.0, 1.0):
        assert record.belongs(0.8 + 0.99 * sign * SAME_RMS_DEG)
        assert not record.belongs(0.8 + 1.01 * sign * SAME_RMS_DEG)
    assert not record.belongs(float("nan"))


def without(key):
    return {name: value for name, value in WHOLE.items() if name != key}


def used(**change):
    content = copy.deepcopy(WHOLE)
    content["static_models"][1].update(change)
    return content


def used_without(key):
    content = copy.deepcopy(WHOLE)
    del content["static_models"][1][key]
    return content


@pytest.mark.parametrize(
    "content",
    cases(
        {
            "cut off": json.dumps(WHOLE)[:-20],
            "of another schema": {**WHOLE, "schema": "pamsim-calibrate/1"},
            "of a later version": {**WHOLE, "schema": "pamsim-rig-calibration/2"},
            "without models": without("static_models"),
            "without command": without("command"),
            "models null": {**WHOLE, "static_models": None},
            "models empty": {**WHOLE, "static_models": []},
            "models as names": {**WHOLE, "static_models": ["first", "used"]},
            "models a mapping": {**WHOLE, "static_models": {"first": 1}},
            "nothing accepted": {**WHOLE, "static_models": [model("tried", False, 1.0, 1.0)]},
            "error null": used(rms_deg=None),
            "error a word": used(leave_one_out_rms_deg="small"),
            "error a list": used(leave_one_out_rms_deg=[1.0]),
            "without error": used_without("rms_deg"),
            "without unseen error": used_without("leave_one_out_rms_deg"),
            "without accepted": used_without("accepted"),
        }
    ),
)
def test_a_damaged_or_other_record_is_refused(rig, content):
    write(rig, content)
    with refused(FILE):
        calibration_record(rig)


@pytest.fixture(scope="module")
def shipped():
    return load_rig("mas20_arm")


def test_every_step_of_the_shipped_record_predicts_unseen_rows_better(shipped):
    """What the page states: no term was taken that only lowers the error in sample."""
    record = calibration_record(shipped)
    accepted = [entry for entry in record.static_models if entry["accepted"]]
    unseen = [entry["leave_one_out_rms_deg"] for entry in accepted]
    assert unseen == sorted(unseen, reverse=True)
    assert len(set(unseen)) == len(unseen) >= 3
    for entry in record.static_models:
        assert entry["leave_one_out_rms_deg"] >= entry["rms_deg"]
    assert record.used["name"].endswith("the model used")


def test_shipped_numbers_are_those_of_the_record_up_to_rounding(shipped):
    record = calibration_record(shipped)
    for found in record.used["parameters"]:
        now = rig_parameter(shipped, found["name"])
        assert now.value == pytest.approx(found["value"], rel=1e-3)
        assert now.stated.source == "identified"
    assert record.used["parameters"]


def test_stated_and_identified_parameters_come_with_their_sources(shipped):
    stated = {entry["name"]: entry for entry in stated_parameters(shipped.file)}
    assert {"passive.locking", "tendon.chain_1.coef", "encoder_increments"} <= set(stated)
    assert "force.law" not in stated
    assert all(entry["source"] for entry in stated.values())
    found = identified_parameters(shipped.file)
    assert found == [e for e in stated.values() if e["source"].startswith("identified")]
    for entry in found:
        low, high = entry["interval95"]
        assert low < entry["value"] < high
    json.dumps(list(stated.values()), allow_nan=False)
