"""The main job: what `pamsim reproduce` promises, on the printed MAS-20 data."""

import json
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from pamsim.cli.main import cli
from pamsim.engine.rig import load_rig
from pamsim.engine.simulate import simulate
from pamsim.papers import reproduce as room
from pamsim.papers.printed_steps import STARTS, start_pressures
from pamsim.recordings.experiment import pressure_step
from pamsim.recordings.printed import distinct_steps, mas20_steps
from pamsim.recordings.recording import Outcome


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """The command's one run: its reproduction, its result, and what it printed."""
    made, file = [], tmp_path_factory.mktemp("reproduce") / "deep" / "r.json"
    whole = room.reproduce
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setattr(
            room, "reproduce", lambda *given, **more: made.append(whole(*given, **more)) or made[0]
        )
        shown = CliRunner().invoke(cli, ["reproduce", "--json", str(file)], standalone_mode=False)
    assert shown.return_value == 0, shown.output
    return made[0], json.loads(file.read_text(encoding="utf-8")), shown.output


@pytest.fixture(scope="module")
def found(ran):
    return ran[0]


@pytest.fixture(scope="module")
def result(ran):
    return ran[1]


def test_result_carries_what_the_contract_names(ran, result):
    assert result["schema"] == "pamsim-reproduce/1"
    for row, step in zip(result["rows"], mas20_steps(), strict=True):
        assert row["p1_kpa"] * 1e3 == step.pressure[0]
        assert row["error_deg"] == pytest.approx(row["simulated_deg"] - row["measured_deg"])
        assert {"row", "p2_kpa", "load_kg"} <= set(row)
        assert f"{row['simulated_deg']:9.2f}" in ran[2]
    for name in ("rms_deg", "fit_percent", "wall_s"):
        assert math.isfinite(result[name])
    errors = [row["error_deg"] for row in result["rows"][:21]]
    assert result["rms_deg"] == pytest.approx(np.sqrt(np.mean(np.square(errors))))
    assert result["g1"]["method"] == result["g2"]["method"] == "output error, unit gain"
    assert result["g1"]["arx"]["unit_gain"]["method"].startswith("ARX least squares")
    assert result["paper"]["g1"]["T_s"] == 0.64595


def test_simulated_arm_is_recognisably_the_measured_one(found, result):
    assert result["rms_deg"] <= 2.0
    assert abs(result["g1"]["T_s"] / 0.64595 - 1) <= 0.10
    for row in result["rows"]:
        assert row["simulated_deg"] * row["measured_deg"] > 0
        assert row["monotonic"] or row["size"] != "large"
    assert all(check["ok"] for check in result["checks"]), result["checks"]
    for row in found.distinct:
        np.testing.assert_allclose(row.recording.pressure[-1], row.step.pressure, atol=500.0)
    for row in found.rows[21:]:
        assert row.recording is found.rows[row.step.repeats - 1].recording


def test_held_out_errors_stand_beside_those_of_the_torque_laws(result):
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


def test_a_reproduction_saves_itself_and_the_readme_states_what_is_found(found, result, tmp_path):
    held, rms = result["calibration"], f"{result['rms_deg']:.2f} deg RMS"
    nested = f"{held['nested_leave_one_out']['rms_deg']:.2f} deg"
    assert found.summary() == (
        f"21 distinct end positions with {nested} RMS held out (nested leave-one-out),"
        f" {rms} in sample; 10 of 10 checks pass"
    )
    found.save(tmp_path)
    saved = json.loads((tmp_path / "reproduction.json").read_text(encoding="utf-8"))
    assert saved == result
    assert len(list(tmp_path.glob("row_*/recording.toml"))) == 21
    readme = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    text = " ".join(readme.partition("## Accuracy")[2].split())
    response = next(c for c in result["checks"] if c["name"] == "response")["sentence"]
    percent = re.search(r"within ([\d.]+) %", response)[1]
    g2 = result["g2"]
    for sentence in (
        f"{rms} over the 21 distinct end positions; {nested} for a row held out",
        f"{held['small_steps_rms_deg']:.2f} deg for the small steps held out together;",
        f"T = {result['g1']['T_s']:.3f} s by output error",
        f"T1 and T2 = {g2['T1_s']:.3f} and {g2['T2_s']:.3f} s",
        f"the large step within {percent} % of the printed model's everywhere",
    ):
        assert sentence in text, sentence


def test_every_start_differs_from_the_end_only_as_it_says():
    for name, start in STARTS.items():
        for step in distinct_steps():
            before, after = start_pressures(step, start), step.pressure
            assert before[0] == before[1]
            unchanged = sum(b == a for b, a in zip(before, after, strict=True))
            assert unchanged >= (0 if name == "maximum" else 1)
            moved_down = all(b >= a for b, a in zip(before, after, strict=True))
            assert moved_down == (name != "fill")


def test_the_end_position_depends_on_the_side_it_is_reached_from_only_by_hysteresis():
    rig, end = load_rig("mas20_arm"), (171e3, 108e3)
    ideal = rig.with_parameters({"hysteresis.force_per_pressure": 0.0})
    (below, above), same = (
        [
            math.degrees(simulate(each, pressure_step(s, end, duration=6.0)).completed().angle[-1])
            for s in ((171e3, 171e3), (171e3, 0.0))
        ]
        for each in (rig, ideal)
    )
    assert abs(np.diff(same)[0]) < 0.01
    assert 0.1 < above - below < 2.0


def test_a_run_that_breaks_down_keeps_its_row_and_the_others_go_on(found, monkeypatch):
    kept = {f"row {row.step.row}": row.recording for row in found.distinct}

    def breaking(_, experiment, **__):
        run = kept[experiment.name]
        if experiment.name == "row 3":
            return replace(run, outcome=Outcome.NOT_FINITE, message="broke on purpose")
        return run

    monkeypatch.setattr(room, "simulate", breaking)
    unknown = load_rig("mas20_arm").with_parameters({"sensor.encoder_increments": 0.0})
    assert room.reproduce(unknown).distinct[0].increment == found.distinct[0].increment
    result = json.loads(json.dumps(room.reproduce().to_dict(), allow_nan=False))
    third, fourth = result["rows"][2:4]
    assert (third["simulated_deg"], third["message"]) == (None, "broke on purpose")
    assert fourth["simulated_deg"] is not None
    assert result["rms_deg"] is None
    failed = {check["name"] for check in result["checks"] if not check["ok"]}
    assert {"completed", "rms"} <= failed
