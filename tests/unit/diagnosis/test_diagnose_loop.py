"""The loop of Alraouf 2025 in both forms in which it is printed, and what may be said of each."""

from __future__ import annotations

import json

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.diagnosis.diagnose_loop import (
    ALRAOUF_2025_FORMS,
    alraouf2025_loop,
    diagnose_length_loop,
    table_loop,
)
from pamsim.store.measured_table import LengthLoop


@pytest.fixture(scope="module")
def reports():
    return {
        form: diagnose_length_loop(alraouf2025_loop(form), ALRAOUF_2025_FORMS[form])
        for form in ALRAOUF_2025_FORMS
    }


def test_printed_branches_are_opened_by_hysteresis_or_creep(reports):
    found = reports["branches"].as_dict()
    assert found["verdict"] == "ambiguous"
    assert found["effects"][0]["name"] == "muscle_hysteresis"
    assert {a["name"] for a in found["alternatives"]} <= {"muscle_hysteresis", "viscoelastic_creep"}
    gap = found["gap"]["length"]
    assert gap["after"]["value_mm"] < 0.5 * gap["before"]["value_mm"]
    assert found["where"][0]["p_value"] < 0.01
    assert "rate" in found["next_experiment"]


def test_printed_means_do_not_carry_a_name(reports):
    """Their branches cross twice, and differ by little more than three runs scatter."""
    found = reports["means"].as_dict()
    assert found["verdict"] == "no_gap"
    assert found["effects"] == []
    assert found["where"][0]["p_value"] > 0.05
    assert found["gap"]["length"]["floor_mm"] > 1.0
    assert found["tried"][0]["name"] == "muscle_hysteresis"
    assert "best resemblance" in found["sentence"]


def test_readings_keep_the_order_of_the_path(reports):
    loop = reports["means"].loop
    assert loop.input[0] == loop.input[-1] == 0.0
    assert loop.input[10] == loop.input[11] == 500e3
    assert loop.output[:2] == pytest.approx([0.30053, 0.2972])
    assert loop.output[-2:] == pytest.approx([0.30073, 0.3005])
    assert loop.error[1] == pytest.approx(0.00624 / np.sqrt(3))


def test_reports_fit_into_json_and_viscous_is_left_to_readings_in_motion(reports):
    for report in reports.values():
        json.dumps(report.as_dict(), allow_nan=False)
        assert "viscous" not in {t["operator"] for t in report.as_dict()["tried"]}
    moving = diagnose_length_loop(alraouf2025_loop("branches"), "in motion", at_rest=False)
    assert "viscous" in {m.name for m in moving.found.tried}


def test_a_user_s_table_and_an_unknown_form():
    loop = alraouf2025_loop("branches")
    table = LengthLoop(pressure=loop.input, length=loop.output, rising=loop.rising)
    assert np.array_equal(table_loop(table).output, loop.output)
    with pytest.raises(InputError, match="did you mean 'means'"):
        alraouf2025_loop("mean")
