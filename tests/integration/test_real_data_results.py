"""The page on real data quotes the recorded diagnoses, and these keep what the page states."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "docs" / "real_data.md").read_text(encoding="utf-8")
PAGE = " ".join(TEXT.split())
EXPECTED = (ROOT / "docs" / "real_data_expectations.md").read_text(encoding="utf-8")
LOOPS = ("alraouf2025", "alraouf2025_equations")


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
    far = region(mas20, "pressure_difference")
    assert far["rows"] == [f"row {n}" for n in range(1, 7)]
    too_far = -mean_there(mas20, "pressure_difference")
    assert f"differences from {far['low']:.0f} kPa on, rows 1 to 6, it goes {too_far:.1f}" in PAGE
    assert f"deg too far (p = {far['p_value']:.4f})" in PAGE
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
    for name in LOOPS:
        result = loops[name]
        best = result["tried"][0]
        before = result["gap"]["length"]["before"]["value"]
        assert (
            f"| {before:.2f} mm | {best['effects'][0]} ({best['form']}) |"
            f" {best['held_out']:.2f} mm | {best['p_value']:.4f} |"
            f" `{result['verdict']}` |" in PAGE
        )
    branches = loops["alraouf2025_equations"]["branches"]
    modelled = np.subtract(*(branches["nearest"][f"{way}_mm"] for way in ("rising", "falling")))
    widest, model_widest = (
        branches["pressure_kpa"][int(np.argmax(apart))]
        for apart in (branches["rising_minus_falling_mm"], modelled)
    )
    assert f"differ most at {widest:.0f} kPa" in PAGE
    assert f"the model's at {model_widest:.0f} kPa" in PAGE
    for row in loops["runs"]:
        assert f"{row['runs']} runs {100.0 * row['claimed']:.0f} %" in PAGE


def test_the_outcomes_are_the_recorded_ones_and_judged_by_what_was_expected(record, mas20):
    means, equations = (record["alraouf2025"][name] for name in LOOPS)
    either = [a["name"] for a in equations["alternatives"]]
    names = ", ".join(f"`{name}`" for name in mas20["certain"])
    for data, row, found, held in (
        (
            "MAS-20 rows",
            "| rows, published map | `ambiguous`, `braid_locking` certain,",
            f"`{mas20['verdict']}`, certain: {names}",
            mas20["verdict"] == "ambiguous" and mas20["certain"] == ["braid_locking"],
        ),
        (
            "Alraouf 2025, Table 2",
            "| Alraouf 2025, Table 2 | `no_gap`:",
            f"`{means['verdict']}`",
            not means["effects"] and not means["alternatives"],
        ),
        (
            "Alraouf 2025, (3) and (4)",
            "| Alraouf 2025, equations (3) and (4) | `ambiguous` between hysteresis and creep |",
            f"`{equations['verdict']}`: {', '.join(f'`{name}`' for name in either)}",
            set(either) == {"muscle_hysteresis", "viscoelastic_creep"},
        ),
    ):
        assert row in EXPECTED
        (line,) = [line for line in TEXT.splitlines() if line.startswith(f"| {data} |")]
        assert line.endswith(f"| {found} | {'held' if held else 'refuted'} |")


def test_the_authors_own_models_stand_beside_what_pamsim_leaves(record, mas20):
    rows, loop = record["authors"]["rows_deg"], record["authors"]["loop_mm"]
    gap = mas20["gap"]["angle_at_rest"]
    for what, value in (
        ("(23) as printed, pressure in bar", rows["equation_23"]),
        ("(23) with the unit of pressure that fits best", rows["equation_23_any_unit"]),
        (
            "its form (17), three coefficients refitted to these rows",
            rows["equation_17_refitted"],
        ),
        (
            "a torque law of three coefficients without a muscle, held-out rows",
            rows["torque_law_held_out"],
        ),
        (
            "pamsim, base with the sprocket radius refitted, held-out rows",
            gap["before"]["value"],
        ),
        ("pamsim, best two effects, held-out rows", gap["after"]["value"]),
    ):
        assert f"| {what} | {value:.2f} deg |" in PAGE
    assert gap["after"]["value"] < rows["torque_law_held_out"]

    def both(model):
        return ", ".join(f"{loop[branch][model]:.2f}" for branch in ("up", "down")) + " mm"

    means = record["alraouf2025"]["alraouf2025"]
    curve = means["in_sample"]["before"]["value"]
    for what, scored, left in (
        (
            "arctangent branches (3), (4), eight coefficients",
            both("arctangent_as_printed"),
            both("arctangent_on_table_2"),
        ),
        ("the same, refitted to Table 2", "", both("arctangent_refitted")),
        ("Bouc-Wen, form and coefficients not printed", both("bouc_wen_as_printed"), ""),
        ("pamsim, reversible curve, eleven values, no loop", "", f"{curve:.2f} mm"),
        (
            "pamsim, reversible curve, unseen readings",
            "",
            f"{means['gap']['length']['before']['value']:.2f} mm",
        ),
    ):
        assert " ".join(f"| {what} | {scored} | {left} |".split()) in PAGE
    assert curve < min(loop[branch]["arctangent_refitted"] for branch in loop)


def test_what_is_declined_is_what_the_results_leave_open(record, mas20):
    absent = mas20["absent"]
    limited = [name for name, limit in absent.items() if not limit.get("cannot_tell")]
    why = {name: limit.get("because", "") for name, limit in absent.items()}
    outside = [name for name in why if "outside the parameter's range" in why[name]]
    assert len(absent) == 12
    assert f"of twelve only {_listed(limited)} have a limit" in PAGE
    assert f"outside the parameter's range ({_listed(outside)})" in PAGE
    assert all(
        re.search("as well as the best|same family", why[name])
        for name in set(absent) - {*limited, *outside}
    )
    assert mas20["repaired_rig"] is None
    assert len(mas20["alternatives"]) == 7
    assert "seven sets of two predict" in PAGE
    behind = max(a["standard_errors_behind"] for a in mas20["alternatives"])
    assert round(behind) == 2
    assert "differ by two standard errors" in PAGE
    floor = mas20["gap"]["angle_at_rest"]["floor"]["value"]
    assert f"a lower bound, {floor:.3f} deg" in PAGE
    added = [a["physical"]["braid_locking.force_change_stretched"] for a in mas20["alternatives"]]
    best, least, most = added[0], *(f(a["value"] for a in added) for f in (min, max))
    low, high = best["interval95"]
    assert f"adds {best['value']:.0f} N [{low:.1f}, {round(high, -2):.0f} N]" in PAGE
    assert f"and {least:.0f} to {most:.0f} N in the seven sets" in PAGE
    others = [name for name in mas20["skipped"] if name != "passive_stiffness"]
    assert f"{len(others)} effects in all" in PAGE
    assert "empty" in mas20["skipped"]["passive_stiffness"]
    assert "isometric force of a stretched muscle" in mas20["next_experiment"]["advice"]
    means, equations = (record["alraouf2025"][name] for name in LOOPS)
    nearest = means["tried"][0]
    assert f"`{nearest['effects'][0]}` ({nearest['form']}), has p = {nearest['p_value']}" in PAGE
    for loop in (means, equations):
        assert list(loop["skipped"]) == ["viscous_friction"]
    assert "tenth of the rate" in equations["next_experiment"]["advice"]


def _listed(names):
    quoted = [f"`{name}`" for name in names]
    return ", ".join(quoted[:-1]) + " and " + quoted[-1]


def test_every_picture_is_small_and_has_a_caption():
    """That they exist is tested with all other links."""
    shown = re.findall(r"!\[[^]]+\]\((images/[\w.]+)\)\n\n\*[^*]+\*\n", TEXT)
    assert len(shown) == TEXT.count("](images/") == 8
    for name in shown:
        assert (ROOT / "docs" / name).stat().st_size < 150e3
