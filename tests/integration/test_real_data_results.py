"""The page on real data quotes the recorded diagnoses, and these hold what is promised of them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = " ".join((ROOT / "docs" / "diagnose_real_data.md").read_text(encoding="utf-8").split())


@pytest.fixture(scope="module")
def record():
    path = ROOT / "scripts" / "results" / "real_data_diagnoses.json"
    return json.loads(path.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def mas20(record):
    return record["mas20"]["wheel radius refitted"]


def where(result, quantity):
    return next(w for w in result["where"] if w["quantity"] == quantity)


def test_the_rows_at_high_common_pressure_are_found_and_repaired(mas20):
    found = where(mas20, "common_pressure")
    assert {"row 19", "row 21"} <= set(found["rows"])
    assert found["p_value"] < 0.01
    assert found["mean_deg"] > 0.0  # the base falls short there
    rows = {row["row"]: row for row in mas20["rows"]}
    for name in found["rows"]:
        assert abs(rows[name]["after_deg"]) < 0.5 * abs(rows[name]["before_deg"])
        assert rows[name]["repaired"]


def test_an_effect_is_named_with_an_interval_and_the_error_shrinks(mas20):
    first, second = mas20["effects"]
    assert first["name"] == "braid_locking"
    assert first["sure"]
    assert not second["sure"]
    low, high = first["parameters"]["passive.locking"]["interval95"]
    assert 0.0 < low < high
    gap = mas20["gap"]["angle_at_rest"]
    assert gap["after"]["value_deg"] < 0.3 * gap["before"]["value_deg"]
    assert gap["before"]["value_deg"] < gap["as_it_stands_deg"]
    assert gap["after"]["interval95_deg"][1] < gap["before"]["interval95_deg"][0]


def test_two_processors_would_take_less_than_three_minutes(mas20):
    assert mas20["processor_seconds"] < 180.0


def test_the_page_s_numbers_are_the_recorded_ones(record, mas20):
    gap = mas20["gap"]["angle_at_rest"]
    one = next(t for t in mas20["tried"] if t["name"] == "braid_locking" and not t["beside"])
    for what, value in (
        ("published map, nothing refitted", gap["as_it_stands_deg"]),
        ("wheel radius refitted", gap["before"]["value_deg"]),
        ("+ braid_locking", one["left_out_rms_deg"]),
        ("+ braid_locking + braid_extensibility", gap["after"]["value_deg"]),
    ):
        assert f"| {what} | {value:.2f} deg |" in PAGE
    found = where(mas20, "common_pressure")
    assert f"short by {found['mean_deg']:.1f} deg" in PAGE
    numbers = ", ".join(name.removeprefix("row ") for name in found["rows"])
    assert f"{numbers} (p = {found['p_value']:.4f}" in PAGE
    first, second = mas20["effects"]
    locking = first["parameters"]["passive.locking"]
    low, high = locking["interval95"]
    assert f"1/{locking['value']:.1f} of the length" in PAGE
    assert f"{low:.1f} to {high:.1f}" in PAGE
    assert f"(p = {first['p_value']:.4f} over all effects tried" in PAGE
    longer = second["parameters"]["braid.extensibility"]
    ends = ", ".join(f"{end * 1e6:.3f}" for end in longer["interval95"])
    assert f"{longer['value'] * 1e6:.3f} [{ends}] per MPa" in PAGE
    rows = {row["row"]: row for row in mas20["rows"]}
    for name in found["rows"]:
        row = rows[name]
        assert f"{name} {row['before_deg']:+.1f} to {row['after_deg']:+.1f} deg" in PAGE
    for alternative in mas20["alternatives"]:
        assert f"`{alternative['name']}`" in PAGE
    assert f"within {mas20['simulated_in_time']['largest_difference_deg']:.3f} deg" in PAGE
    loops = record["alraouf2025"]
    for form in ("means", "branches"):
        result = loops[form]
        best = result["tried"][0]
        before = result["gap"]["length"]["before"]["value_mm"]
        assert (
            f"| {before:.2f} mm | {best['name']} ({best['operator']}) |"
            f" {best['unseen_rms_mm']:.2f} mm | {100.0 * best['p_value_luck']:.1f} % |"
            f" `{result['verdict']}` |" in PAGE
        )
    for row in loops["runs"]:
        assert f"{row['runs']} runs {100.0 * row['claimed']:.0f} %" in PAGE


def test_twins_are_named_rightly_or_left_open(record):
    rows = {row["hidden"]: row for row in record["twins"]["rows"]}
    assert rows.pop("nothing")["verdict"] == "no_gap"
    for hidden, row in rows.items():
        named = [effect["name"] for effect in row["effects"]]
        others = list(dict.fromkeys(a["name"] for a in row["alternatives"]))
        assert row["verdict"] in ("named", "ambiguous")
        if hidden.endswith("not in the library"):
            assert row["verdict"] == "ambiguous"
        else:
            assert hidden in (*named, *others)
            assert len(named) == 1
        text = (
            f"| {hidden} | `{row['verdict']}` | {', '.join(named)} | {', '.join(others) or '-'} |"
        )
        assert text in PAGE
