"""The page on real data quotes the recorded diagnoses, and these keep what the page states."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = " ".join((ROOT / "docs" / "real_data.md").read_text(encoding="utf-8").split())


@pytest.fixture(scope="module")
def record():
    path = ROOT / "scripts" / "results" / "real_data_diagnoses.json"
    return json.loads(path.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def mas20(record):
    return record["mas20"]["sprocket radius refitted"]


def region(result, quantity):
    regions = [place["region"] for place in result["where"]]
    return next(r for r in regions if r["quantity"] == quantity)


def mean_there(result, quantity):
    """Mean of measured minus simulated in the bin of the region [deg]."""
    entry = next(m for m in result["maps"] if m["quantity"] == quantity)
    return entry["mean"][entry["rows"].index(region(result, quantity)["rows"])]


def attempt(result, *effects):
    return next(t for t in result["tried"] if t["effects"] == list(effects))


def test_the_rows_at_high_common_pressure_are_found_and_repaired(mas20):
    place = region(mas20, "common_pressure")
    assert {"row 19", "row 21"} <= set(place["rows"])
    assert place["p_value"] < 0.01
    assert mean_there(mas20, "common_pressure") > 0.0  # the base falls short there
    rows = {row["row"]: row for row in mas20["rows"]}
    for name in place["rows"]:
        assert abs(rows[name]["after_deg"]) < 0.5 * abs(rows[name]["before_deg"])
        assert rows[name]["repaired"]


def test_one_effect_is_certain_with_an_interval_and_the_error_shrinks(mas20):
    assert mas20["verdict"] == "ambiguous"
    assert mas20["certain"] == ["braid_locking"]
    assert all("braid_locking" in a["name"].split("+") for a in mas20["alternatives"])
    low, high = mas20["alternatives"][0]["parameters"]["passive.locking"]["interval95"]
    assert 0.0 < low < high
    gap = mas20["gap"]["angle_at_rest"]
    assert gap["after"]["value"] < 0.3 * gap["before"]["value"]
    assert gap["before"]["value"] < gap["as_it_stands"]["value"]
    assert gap["after"]["interval95"][1] < gap["before"]["interval95"][0]


def test_two_processors_would_take_less_than_three_minutes(mas20):
    assert mas20["processor_seconds"] < 180.0


def test_the_page_s_numbers_are_the_recorded_ones(record, mas20):
    gap = mas20["gap"]["angle_at_rest"]
    locking_alone = attempt(mas20, "braid_locking")
    for what, value in (
        ("published map, nothing refitted", gap["as_it_stands"]["value"]),
        ("sprocket radius refitted", gap["before"]["value"]),
        ("+ braid_locking", locking_alone["held_out"]),
        ("+ braid_locking + braid_extensibility", gap["after"]["value"]),
    ):
        assert f"| {what} | {value:.2f} deg |" in PAGE
    place = region(mas20, "common_pressure")
    assert f"short by {mean_there(mas20, 'common_pressure'):.1f} deg" in PAGE
    numbers = ", ".join(name.removeprefix("row ") for name in place["rows"])
    assert f"{numbers} (p = {place['p_value']:.4f}" in PAGE
    best = mas20["alternatives"][0]["parameters"]
    low, high = best["passive.locking"]["interval95"]
    assert f"1/{best['passive.locking']['value']:.1f} of the length" in PAGE
    assert f"{low:.1f} to {high:.1f}" in PAGE
    assert f"(p = {locking_alone['p_value']:.4f}, corrected for all effects tried" in PAGE
    assert f"held-out rows, p = {locking_alone['p_value_unseen']:.4f})" in PAGE
    longer = best["braid.extensibility"]
    ends = ", ".join(f"{end * 1e6:.3f}" for end in longer["interval95_si"])
    assert f"{longer['value_si'] * 1e6:.3f} [{ends}] per MPa" in PAGE
    rows = {row["row"]: row for row in mas20["rows"]}
    for name in place["rows"]:
        row = rows[name]
        assert f"{name} {row['before_deg']:+.1f} to {row['after_deg']:+.1f} deg" in PAGE
    for alternative in mas20["alternatives"]:
        (other,) = set(alternative["name"].split("+")) - {"braid_locking"}
        assert f"`{other}`" in PAGE
    assert f"within {mas20['simulated_in_time']['largest_difference_deg']:.3f} deg" in PAGE
    loops = record["alraouf2025"]
    for name in ("alraouf2025", "alraouf2025_equations"):
        result = loops[name]
        best = result["tried"][0]
        before = result["gap"]["length"]["before"]["value"]
        assert (
            f"| {before:.2f} mm | {best['effects'][0]} ({best['form']}) |"
            f" {best['held_out']:.2f} mm | {best['p_value']:.4f} |"
            f" `{result['verdict']}` |" in PAGE
        )
    for row in loops["runs"]:
        assert f"{row['runs']} runs {100.0 * row['claimed']:.0f} %" in PAGE


def test_hidden_effects_are_named_or_among_the_alternatives(record):
    rows = {row["hidden"]: row for row in record["synthetic"]["rows"]}
    assert rows["nothing"]["verdict"] == "no_gap"
    for hidden, row in rows.items():
        named = [effect["name"] for effect in row["effects"]]
        others = dict.fromkeys(n for a in row["alternatives"] for n in a["name"].split("+"))
        if hidden.endswith("not in the library"):
            assert row["verdict"] == "ambiguous"
        elif hidden != "nothing":
            assert row["verdict"] in ("named", "ambiguous")
            assert hidden in (*named, *others)
        text = f"| {hidden} | `{row['verdict']}` | {', '.join(named) or '-'} |"
        assert f"{text} {', '.join(others) or '-'} |" in PAGE
