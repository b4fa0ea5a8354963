"""Numbers that documents quote are those of the recorded results."""

from __future__ import annotations

import json
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def recorded(name):
    return json.loads((ROOT / "scripts" / name).read_text(encoding="utf-8"))


def test_identify_s_table_is_that_of_the_study():
    study = recorded("results/identify_study.json")
    own = study["side_by_side_without_dead_time"]
    peers = study["peers_on_the_same_records"]["scenarios"]
    text = (ROOT / "docs" / "identify.md").read_text(encoding="utf-8")
    lines = [re.split(r"\s*\|\s*", line.strip("| ")) for line in text.splitlines() if "|" in line]
    head = next(cells for cells in lines if cells[0].startswith("median error"))
    scenarios = head[1:-1]
    rows = lines[lines.index(head) + 2 :]
    checked = 0
    for method, *cells, seconds in rows:
        for scenario, cell in zip(scenarios, cells, strict=True):
            found = {**own[scenario], **peers[scenario]}[method]
            pair = [found[f"median_error_{k}_percent"] for k in ("T1", "T2")]
            assert cell == " / ".join(f"{value:.1f}" for value in pair), (method, scenario)
            checked += 1
        assert seconds == f"{found_seconds(own, peers, method):.2g}"
    assert checked == 21


def found_seconds(own, peers, method):
    return {**own["20 dB white"], **peers["20 dB white"]}[method]["median_seconds"]


def test_identify_study_meets_what_is_promised():
    """Errors, dead times and coverage over 200 records of each kind."""
    recovery = recorded("results/identify_study.json")["recovery"]
    for name, found in recovery.items():
        assert found["runs"] == 200
        assert found["dead_time_within_one_sample_percent"] > 95.0
        for parameter, row in found["parameters"].items():
            assert 90.0 <= row["coverage_percent"] <= 98.0, (name, parameter)
    for parameter in ("T1", "T2"):
        assert recovery["40 dB white"]["parameters"][parameter]["median_error_percent"] < 1.0
    at_20 = recovery["20 dB white"]["parameters"]
    assert at_20["T2"]["median_error_percent"] < 3.0
    assert at_20["T1"]["median_error_percent"] < 10.0


def test_calibrate_study_meets_what_is_promised():
    """Coverage over 200 calibrations under white and 200 under drifting noise."""
    study = recorded("results/calibrate_study.json")
    for name, found in study["coverage"].items():
        assert found["runs"] == 200
        for parameter, row in found["parameters"].items():
            assert 90.0 <= row["coverage_percent"] <= 98.0, (name, parameter)
    blind = study["rank_deficient"]["valves only fill"]
    assert "converged" not in blind["statuses"]
    assert blind["doubts_percent"]["valve.conductance_fill"] == {}
    doubted = blind["doubts_percent"]["valve.conductance_exhaust"]
    assert set(doubted) <= {"dead", "at_bound"}
    assert sum(doubted.values()) >= 100.0
    assert study["rank_deficient"]["rest without load"]["doubts_percent"] == {
        name: {"trade_off": 100.0} for name in ("force.scale", "passive.stiffness")
    }
