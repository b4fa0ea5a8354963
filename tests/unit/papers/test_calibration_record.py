"""The record of a rig's calibration: what belongs to it is used, what is damaged is refused."""

from __future__ import annotations

import json
import tomllib
from types import SimpleNamespace

import numpy as np
import pytest

from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import load_rig
from pamsim.papers.calibration_record import (
    FILE,
    SAME_RMS_DEG,
    SCHEMA,
    calibration_record,
    stated_parameters,
)
from pamsim.recordings.printed import Printed
from tests.unit.core.refusals import refused

MEASURED = np.random.default_rng(3).standard_normal(12)
COLUMNS = np.random.default_rng(4).standard_normal((12, 3))


def model(name, accepted, *columns):
    """Entry of a linear model of noise [deg], with its exact held-out errors."""
    rows = COLUMNS[:, columns]
    hat = rows @ np.linalg.pinv(rows)
    residual = hat @ MEASURED - MEASURED
    left_out = residual / (1.0 - np.diag(hat))
    return {
        "name": name,
        "accepted": accepted,
        "rms_deg": float(np.sqrt(np.mean(residual**2))),
        "leave_one_out_rms_deg": float(np.sqrt(np.mean(left_out**2))),
        "left_out_block_rms_deg": {"small steps": 1.3, "large steps": None},
        "parameters": [{}] * len(columns),
        "residual_deg": residual.tolist(),
        "leave_one_out_residual_deg": left_out.tolist(),
        "jacobian_deg": rows.tolist(),
    }


MODELS = [model("first", True), model("used", True, 0), model("tried", False, 0, 1)]
WHOLE = {"schema": SCHEMA, "command": "python calibrate.py", "static_models": MODELS}


def changed(entry, change):
    """A copy with other values; `...` leaves one out."""
    return {name: value for name, value in {**entry, **change}.items() if value is not ...}


def whole(**change):
    return changed(WHOLE, change)


def used(**change):
    first, second, *rest = MODELS
    return whole(static_models=[first, changed(second, change), *rest])


@pytest.fixture
def read(tmp_path):
    """Reads a record of this content beside something with a folder, which is all of a rig that is
    looked at."""
    rig = SimpleNamespace(file=SimpleNamespace(folder=tmp_path))
    assert calibration_record(rig) is None  # a rig need not have one

    def written(content):
        text = content if isinstance(content, str) else json.dumps(content)
        (tmp_path / FILE).write_text(text, encoding="utf-8")
        return calibration_record(rig)

    return written


def test_the_model_used_is_the_last_one_accepted_and_simulates_as_it_did(read):
    record = read({**used(left_out_block_rms_deg={"small steps": 0.7}), "future": 1})
    assert record.used["name"] == "used"
    assert record.small_steps_rms_deg == 0.7
    assert record.command == "python calibrate.py"
    assert [entry["name"] for entry in record.static_models] == ["first", "used", "tried"]
    rms = record.used["rms_deg"]
    for sign in (-1.0, 1.0):
        assert record.belongs(rms + 0.99 * sign * SAME_RMS_DEG)
        assert not record.belongs(rms + 1.01 * sign * SAME_RMS_DEG)
    assert not record.belongs(float("nan"))


def test_nested_error_is_that_of_the_form_chosen_row_by_row_among_all(read):
    nested = read(WHOLE).nested
    left_out = {entry["name"]: entry["leave_one_out_residual_deg"] for entry in MODELS}
    chosen = [best_without(row) for row in range(MEASURED.size)]
    errors = [left_out[name][row] for row, name in enumerate(chosen)]
    assert nested.rms_deg == pytest.approx(np.sqrt(np.mean(np.square(errors))))
    assert nested.selected == {name: chosen.count(name) for name in left_out if name in chosen}
    assert len(nested.selected) > 1
    counts = list(nested.selected.values())
    assert counts == sorted(counts, reverse=True)
    record = read(whole(static_models=MODELS[1:2]))  # of one model: nothing to choose
    assert record.nested.rms_deg == pytest.approx(record.used["leave_one_out_rms_deg"])
    assert record.nested.selected == {"used": MEASURED.size}


def best_without(row):
    """Name of the model that predicts the other rows best, from scratch."""
    keep = np.arange(MEASURED.size) != row

    def error(entry):
        rows, measured = np.array(entry["jacobian_deg"])[keep], MEASURED[keep]
        hat = rows @ np.linalg.pinv(rows)
        return np.sum(((hat @ measured - measured) / (1.0 - np.diag(hat))) ** 2)

    return min(MODELS, key=error)["name"]


DAMAGED = {
    "cut off": json.dumps(WHOLE)[:-20],
    "of another schema": whole(schema="pamsim-calibrate/1"),
    "of a later version": whole(schema="pamsim-rig-calibration/2"),
    "nothing accepted": whole(static_models=[model("tried", False)]),
    **{
        f"static_models {value}": whole(static_models=value)
        for value in (..., None, [], ["first", "used"], {"first": 1})
    },
    "no command": whole(command=...),
    **{f"no {key}": used(**{key: ...}) for key in MODELS[0] if key not in ("name",)},
    "error null": used(rms_deg=None),
    "error a word": used(leave_one_out_rms_deg="small"),
    "error a list": used(leave_one_out_rms_deg=[1.0]),
    "no small steps": used(left_out_block_rms_deg={"large steps": 1.0}),
    "small steps not predicted": used(left_out_block_rms_deg={"small steps": None}),
    "errors of other rows": used(leave_one_out_residual_deg=[1.0] * 12),
    "errors of another fit": used(rms_deg=0.5),
    "one held-out row": used(leave_one_out_residual_deg=[1.0], leave_one_out_rms_deg=1.0),
    "a row null": used(residual_deg=[None] * 12),
    "jacobian of fewer rows": used(jacobian_deg=[[1.0]] * 11),
    "jacobian of more parameters": used(jacobian_deg=[[1.0, 2.0]] * 12),
    "jacobian in words": used(jacobian_deg=[["steep"]] * 12),
}


def test_a_damaged_or_other_record_is_refused(read):
    for damage, content in DAMAGED.items():
        try:
            with refused(FILE):
                read(content)
        except pytest.fail.Exception:
            pytest.fail(damage)


def test_every_step_of_the_shipped_record_predicts_unseen_rows_better():
    """What the page states: no term was taken that only lowers the error in sample."""
    record = calibration_record(load_rig("mas20_arm"))
    unseen = [e["leave_one_out_rms_deg"] for e in record.static_models if e["accepted"]]
    assert unseen == sorted(set(unseen), reverse=True)
    assert len(unseen) >= 3
    for entry in record.static_models:
        assert entry["leave_one_out_rms_deg"] >= entry["rms_deg"]
    assert record.used["name"].endswith("the model used")


def printed_as(text, name):
    """Value and interval of a parameter as params.toml writes them, with their digits."""
    group, _, own = name.partition(".")
    entry = text["native"].get(name) or text["muscle"][group][own]
    return entry["value"], *entry["interval95"]


def test_shipped_numbers_are_those_of_the_record_up_to_rounding():
    """Value and both ends of the interval of every identified parameter, to its last digit."""
    shipped = load_rig("mas20_arm")
    folder = shipped.file.folder
    text = tomllib.loads((folder / "params.toml").read_text("utf-8"), parse_float=Printed.read)
    dynamic = json.loads((folder / FILE).read_text("utf-8"))["dynamic"]
    found = {
        entry["name"]: (entry["value"], *entry["interval95"])
        for entry in (*calibration_record(shipped).used["parameters"], *dynamic["parameters"])
    }
    # The damping used is not that of the printed step alone, and the conductance goes with it.
    exhaust, damping = "valve.conductance_exhaust", "joint.shaft.damping"
    found[exhaust] = (dynamic["conductance_m3_s_Pa"], *found[exhaust][1:])
    found[damping] = (dynamic["damping_N_m_s_rad"], *found[damping][1:])
    found["valve.conductance_fill"] = found[exhaust]
    assert set(found) == {
        entry["name"]
        for entry in stated_parameters(shipped.file)
        if entry["source"].startswith("identified")
    }
    for name, numbers in found.items():
        now = rig_parameter(shipped, name)
        unit = now.value / now.stated.value
        for recorded, stated in zip(numbers, printed_as(text, name), strict=True):
            away = abs(recorded / unit - stated.value)
            assert away <= stated.half_unit * (1.0 + 1e-6), (name, recorded / unit, stated)


def test_stated_and_identified_parameters_come_with_their_sources():
    file = load_rig("mas20_arm").file
    stated = {entry["name"]: entry for entry in stated_parameters(file)}
    assert {"passive.locking", "tendon.chain_1.coef", "encoder_increments"} <= set(stated)
    assert "force.law" not in stated
    assert all(entry["source"] for entry in stated.values())
    for entry in stated.values():
        if entry["source"].startswith("identified"):
            low, high = entry["interval95"]
            assert low < entry["value"] < high
    json.dumps(list(stated.values()), allow_nan=False)
