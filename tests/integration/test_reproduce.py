"""The main job: what `pamsim reproduce` promises, on the printed MAS-20 data."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pamsim.cli.main import cli
from pamsim.engine.rig import load_rig
from pamsim.engine.simulate import simulate
from pamsim.papers.printed_steps import STARTS, start_pressures
from pamsim.papers.reproduce import reproduce
from pamsim.recordings.experiment import pressure_step
from pamsim.recordings.printed import distinct_steps, mas20_models, mas20_steps
from pamsim.recordings.recording import Outcome


@pytest.fixture(scope="module")
def found():
    return reproduce()


@pytest.fixture(scope="module")
def result(found):
    return json.loads(json.dumps(found.to_dict(), allow_nan=False))


def test_printed_tables_are_whole_and_consistent():
    steps = mas20_steps()
    assert len(steps) == 24
    assert len(distinct_steps()) == 21
    for step in steps:
        # 2500 increments per revolution; the print's own rounding is 0.06 deg at worst.
        angle = math.degrees(step.angle)
        if step.row != 4:  # its increment is printed without the minus sign
            assert abs(step.increments * 0.144 - angle) < 0.06, step.row
        assert math.copysign(1, step.angle) == math.copysign(1, step.pressure[0] - step.pressure[1])
        if step.repeats:
            original = steps[step.repeats - 1]
            assert (step.pressure, step.load, step.angle) == (
                original.pressure,
                original.load,
                original.angle,
            )
    g2 = mas20_models()["g2"]
    assert g2["T1_s"] * g2["T2_s"] == pytest.approx(0.052267, abs=5e-7)


def test_a_reproduction_sums_itself_up_and_saves_itself(found, result, tmp_path):
    nested = result["calibration"]["nested_leave_one_out"]["rms_deg"]
    assert found.summary() == (
        f"21 distinct end positions with {nested:.2f} deg RMS held out (nested leave-one-out),"
        f" {result['rms_deg']:.2f} deg RMS in sample; 10 of 10 checks pass"
    )
    found.save(tmp_path)
    saved = json.loads((tmp_path / "reproduction.json").read_text(encoding="utf-8"))
    assert saved == result
    assert len(list(tmp_path.glob("row_*/recording.toml"))) == 21


def test_the_readme_states_what_is_found(result):
    readme = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    text = " ".join(readme.partition("## Accuracy")[2].split())
    held = result["calibration"]
    response = next(c for c in result["checks"] if c["name"] == "response")["sentence"]
    percent = re.search(r"within ([\d.]+) %", response)
    assert percent
    for sentence in (
        f"{result['rms_deg']:.2f} deg RMS over the 21 distinct end positions;"
        f" {held['nested_leave_one_out']['rms_deg']:.2f} deg for a row held out",
        f"{held['small_steps_rms_deg']:.2f} deg for the small steps held out together;",
        f"T = {result['g1']['T_s']:.3f} s by output error",
        f"T1 and T2 = {result['g2']['T1_s']:.3f} and {result['g2']['T2_s']:.3f} s",
        f"the large step within {percent[1]} % of the printed model's everywhere",
    ):
        assert sentence in text, sentence


def test_held_out_errors_belong_to_the_start_and_the_parameters_they_were_found_with(found):
    assert found.held_out is found.record
    assert found.to_dict()["calibration"]["applies"]
    used = {**found.record.used, "rms_deg": found.rms_deg + 0.5}
    for other in (
        replace(found, start=STARTS["fill"]),
        replace(found, record=None),
        replace(found, record=replace(found.record, static_models=(used,))),
    ):
        assert other.held_out is None
        assert "held out" not in other.summary()
        calibration = other.to_dict()["calibration"]
        assert calibration is None or not calibration["applies"]


def test_result_carries_the_held_out_errors_beside_those_of_the_torque_laws(result):
    calibration = result["calibration"]
    nested, best = calibration["nested_leave_one_out"], calibration["best_torque_laws"]
    assert sum(nested["selected"].values()) == 21
    assert set(nested["selected"]) <= {model["name"] for model in result["static_models"]}
    assert nested["rms_deg"] > result["rms_deg"]
    assert calibration["leave_one_out_rms_deg"] > result["rms_deg"]
    assert calibration["small_steps_rms_deg"] > 0.0
    laws = calibration["torque_laws"]
    for key in ("leave_one_out_rms_deg", "small_steps_rms_deg"):
        assert best[key] == min(law[key] for law in laws if law[key] is not None)


def test_result_carries_what_the_contract_names(result):
    assert len(result["rows"]) == 24
    keys = {"row", "p1_kpa", "p2_kpa", "load_kg", "measured_deg", "simulated_deg", "error_deg"}
    for row, step in zip(result["rows"], mas20_steps(), strict=True):
        assert keys <= set(row)
        assert row["p1_kpa"] * 1e3 == step.pressure[0]
        assert row["error_deg"] == pytest.approx(row["simulated_deg"] - row["measured_deg"])
    for name in ("rms_deg", "fit_percent", "wall_s"):
        assert math.isfinite(result[name])
    errors = [row["error_deg"] for row in result["rows"][:21]]
    assert result["rms_deg"] == pytest.approx(np.sqrt(np.mean(np.square(errors))))
    assert result["g1"]["method"] == result["g2"]["method"] == "output error, unit gain"
    assert result["g1"]["arx"]["unit_gain"]["method"].startswith("ARX least squares")
    assert result["paper"]["g1"]["T_s"] == 0.64595


def test_simulated_arm_is_recognisably_the_measured_one(result):
    assert result["rms_deg"] <= 2.0
    assert abs(result["g1"]["T_s"] / 0.64595 - 1) <= 0.10
    for row in result["rows"]:
        assert row["simulated_deg"] * row["measured_deg"] > 0
        if row["size"] == "large":
            assert row["monotonic"]
    assert all(check["ok"] for check in result["checks"]), result["checks"]


def test_pressures_end_where_the_print_says(found):
    for row in found.distinct:
        np.testing.assert_allclose(row.recording.pressure[-1], row.step.pressure, atol=500.0)


def test_repeated_rows_share_their_simulation(found):
    for row in found.rows[21:]:
        assert row.recording is found.rows[row.step.repeats - 1].recording


@pytest.mark.parametrize("name", STARTS)
def test_every_start_differs_from_the_end_only_as_it_says(name):
    for step in distinct_steps():
        before, after = start_pressures(step, STARTS[name]), step.pressure
        assert before[0] == before[1]
        unchanged = sum(b == a for b, a in zip(before, after, strict=True))
        assert unchanged >= (0 if name == "maximum" else 1)
        moved_down = all(b >= a for b, a in zip(before, after, strict=True))
        assert moved_down == (name != "fill")


def test_the_end_position_depends_on_the_side_it_is_reached_from_only_by_hysteresis():
    rig = load_rig("mas20_arm")
    ideal = rig.with_parameters({"hysteresis.force_per_pressure": 0.0})
    end = (171e3, 108e3)

    def ends(which):
        return [
            math.degrees(simulate(which, pressure_step(s, end, duration=6.0)).completed().angle[-1])
            for s in ((171e3, 171e3), (171e3, 0.0))
        ]

    below, above = ends(rig)
    assert abs(np.diff(ends(ideal))[0]) < 0.01
    assert 0.1 < above - below < 2.0


def test_a_run_that_breaks_down_keeps_its_row_and_the_others_go_on(monkeypatch):
    from pamsim.papers import reproduce as module

    whole = module.simulate

    def breaking(rig, experiment, **options):
        recording = whole(rig, experiment, **options)
        if experiment.name == "row 3":
            return replace(recording, outcome=Outcome.NOT_FINITE, message="broke on purpose")
        return recording

    monkeypatch.setattr(module, "simulate", breaking)
    result = json.loads(json.dumps(reproduce().to_dict(), allow_nan=False))
    assert result["rows"][2]["simulated_deg"] is None
    assert result["rows"][2]["message"] == "broke on purpose"
    assert result["rows"][3]["simulated_deg"] is not None
    assert result["rms_deg"] is None
    failed = [check["name"] for check in result["checks"] if not check["ok"]]
    assert {"completed", "rms"} <= set(failed)


def test_command_writes_json_and_exits_by_the_checks(tmp_path, monkeypatch):
    from click.testing import CliRunner

    target = tmp_path / "deep" / "r.json"
    shown = CliRunner().invoke(cli, ["reproduce", "--json", str(target)], standalone_mode=False)
    assert shown.return_value == 0, shown.output
    assert json.loads(target.read_text())["schema"] == "pamsim-reproduce/1"
    assert "row" in shown.output
