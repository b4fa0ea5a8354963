"""The page on real data quotes the recorded diagnoses, and these keep what the page states."""

from __future__ import annotations

import re

import numpy as np
import pytest

from tests.records import ROOT, SCRIPTS, page, recorded, words

TEXT, PAGE = page("real_data"), words("real_data")
EXPECTED = (SCRIPTS / "results" / "real_data_expectations.md").read_text(encoding="utf-8")
LOOPS = ("alraouf2025", "alraouf2025_equations")


@pytest.fixture(scope="module")
def record():
    return recorded("results/real_data_diagnoses")


@pytest.fixture(scope="module")
def mas20(record):
    return record["mas20"]


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def test_one_effect_is_certain_with_an_interval_and_the_error_shrinks(mas20):
    assert mas20["verdict"] == "ambiguous"
    locking, longer = mas20["effects"]
    assert (locking["effect"], locking["level"]) == ("braid_locking", "form")
    assert (longer["effect"], longer["level"]) == ("braid_extensibility", "")
    low, high = locking["sizes"]["passive.locking"]["interval95"]
    assert 0.0 < low < high
    gap = mas20["gap"]["angle_at_rest"]
    assert gap["after"] < 0.3 * gap["before"]
    assert gap["before"] < mas20["as_it_is_deg"]
    rows = {row["row"]: row for row in mas20["rows"]}
    for name in ("row 13", "row 19", "row 20", "row 21"):
        assert abs(rows[name]["after_deg"]) < 0.5 * abs(rows[name]["before_deg"])


def test_two_processors_would_take_less_than_three_minutes(mas20):
    assert mas20["processor_seconds"] < 180.0


def test_the_page_s_numbers_are_the_recorded_ones(record, mas20):
    gap = mas20["gap"]["angle_at_rest"]
    for what, value in (
        ("published map, nothing refitted, all rows", mas20["as_it_is_deg"]),
        ("sprocket radius refitted", gap["before"]),
        ("+ braid_locking + braid_extensibility", gap["after"]),
    ):
        assert f"| {what} | {value:.2f} deg |" in PAGE
    locking, longer = mas20["effects"]
    size = locking["sizes"]["passive.locking"]
    low, high = size["interval95"]
    assert f"1/{size['value']:.1f} of the length" in PAGE
    assert f"{low:.1f} to {high:.1f}" in PAGE
    assert f"(p = {locking['p_value']:.4f} that it is not there)" in PAGE
    assert f"there (p = {longer['p_value']:.3f}), and its place is open" in PAGE
    added = longer["sizes"]["braid.extensibility"]
    ends = ", ".join(f"{end * 1e6:.3f}" for end in added["interval95_si"])
    assert f"{added['value_si'] * 1e6:.3f} [{ends}] per MPa" in PAGE
    for row in mas20["rows"]:
        if min(row["pressure_kpa"]) >= 160.0:
            errors = f"{row['row']} {row['before_deg']:+.1f} to {row['after_deg']:+.1f} deg"
            assert errors in PAGE
    for rival in mas20["alternatives"]["braid_extensibility"]:
        assert f"`{rival}`" in PAGE
    assert f"leaves {mas20['repaired_in_time_deg']:.2f} deg RMS" in PAGE
    loops = record["alraouf2025"]
    for name in LOOPS:
        result, after = loops[name], ""
        before = result["gap"]["length"]["before"]
        for best in result["effects"]:
            after = f" {best['name']} ({best['form']}) | {result['gap']['length']['after']:.2f} mm"
            after += f" | {best['p_value']:.4f} |"
        assert f"| {before:.2f} mm |{after or ' - | - | - |'} `{result['verdict']}` |" in PAGE
        assert f"(p = {result['links'][0]['p_value']:.2f}" in PAGE or result["effects"]
    assert f"p = {loops[LOOPS[1]]['links'][0]['p_value']:.3f}" in PAGE
    for row in loops["runs"]:
        shares = f"{100.0 * row['found']:.0f} and {100.0 * row['named']:.0f} %"
        assert f"{row['runs']} runs {shares}" in PAGE


def test_the_outcomes_are_the_recorded_ones_and_judged_by_what_was_expected(record, mas20):
    means, equations = (record["alraouf2025"][name] for name in LOOPS)
    certain = [one["name"] for one in mas20["effects"] if one["certain"]["name"]]
    (found,) = equations["effects"]
    other = {name.partition(":")[0] for name in equations["alternatives"][found["effect"]]}
    either = dict.fromkeys((found["name"], *sorted(other)))
    for data, row, outcome, held in (
        (
            "MAS-20 rows",
            "| rows, published map | `ambiguous`, `braid_locking` certain,",
            f"`{mas20['verdict']}`, certain: {', '.join(f'`{name}`' for name in certain)}",
            mas20["verdict"] == "ambiguous" and certain == ["braid_locking"],
        ),
        (
            "Alraouf 2025, Table 2",
            "| Alraouf 2025, Table 2 | `no_gap`:",
            f"`{means['verdict']}`",
            not means["effects"],
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
        assert line.endswith(f"| {outcome} | {'held' if held else 'refuted'} |")


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
            gap["before"],
        ),
        ("pamsim, best two effects, held-out rows", gap["after"]),
    ):
        assert f"| {what} | {value:.2f} deg |" in PAGE
    assert gap["after"] < rows["torque_law_held_out"]

    def both(model):
        return ", ".join(f"{loop[branch][model]:.2f}" for branch in ("up", "down")) + " mm"

    means = record["alraouf2025"]["alraouf2025"]
    branches = means["branches"]
    curve = 0.5 * rms(np.subtract(branches["rising_mm"], branches["falling_mm"]))
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
            f"{means['gap']['length']['before']:.2f} mm",
        ),
    ):
        assert " ".join(f"| {what} | {scored} | {left} |".split()) in PAGE
    assert curve < min(loop[branch]["arctangent_refitted"] for branch in loop)


def test_what_is_declined_is_what_the_results_leave_open(record, mas20):
    assert mas20["repaired_rig"] is None
    floor = mas20["gap"]["angle_at_rest"]["floor"]
    assert f"a lower bound, {floor:.3f} deg" in PAGE
    added = mas20["effects"][0]["physical"]["force_change_stretched"]
    low, high = added["interval95"]
    assert f"adds {added['value']:.0f} [{low:.1f}, {high:.0f}] N" in PAGE
    (link,) = mas20["links"]
    assert not link["more_left"]
    assert f"(p = {link['p_value']:.2f}). The encoder's step" in PAGE
    skipped = mas20["run"]["skipped"]
    others = [name for name in skipped if name != "passive_stiffness"]
    assert f"{len(others)} effects in all" in PAGE
    assert "empty" in skipped["passive_stiffness"]
    assert "isometric force of a stretched muscle" in mas20["next_experiment"]["advice"]
    for name in LOOPS:
        assert list(record["alraouf2025"][name]["run"]["skipped"]) == ["viscous_friction"]
    assert "tenth of the rate" in record["alraouf2025"][LOOPS[1]]["next_experiment"]["advice"]


def test_every_picture_is_small_and_has_a_caption():
    """That they exist is tested with all other links."""
    shown = re.findall(r"!\[[^]]+\]\((images/[\w.]+)\)\n\n\*[^*]+\*\n", TEXT)
    assert len(shown) == TEXT.count("](images/") == 8
    for name in shown:
        assert (ROOT / "docs" / name).stat().st_size < 150e3
