"""The page on real data quotes the record of the EquiMus leg."""

from __future__ import annotations

import pytest

from tests.records import recorded, words

PAGE = words("real_data")
JOINTS = ("hip", "knee")
RIGS = {
    "as_shipped": "authors' numbers, assumed valves",
    "as_the_authors": "calibrated: areas, springs, dampers",
    "with_valves": "calibrated: the same and valves",
}


@pytest.fixture(scope="module")
def leg():
    return recorded("results/equimus_leg")


def row(what, numbers):
    return f"| {what} | {numbers['hip']:.4f} | {numbers['knee']:.4f} |"


def test_the_leg_s_table_is_the_record(leg):
    opened, judged = leg["open"], leg["judge"]
    assert row("what cycles differ by", opened["floors"]) in PAGE
    assert row("authors' numbers, pressures imposed", opened["cycles_2_to_10"]) in PAGE
    for name, what in RIGS.items():
        assert row(what, judged["rigs"][name]["rms"]) in PAGE
    cut = judged["rigs"]["with_valves"]["small_commands_as_none"]
    assert row("the last, commands below 5 kPa taken as none", cut) in PAGE


def test_the_printed_score_is_made_of_a_slip_and_of_seconds_without_data(leg):
    opened = leg["open"]
    for name in ("as_the_notebook_simulates", "the_same_while_recorded", "cycles_2_to_10"):
        assert " and ".join(f"{opened[name][j]:.4f}" for j in JOINTS) in PAGE
    simulated = opened["as_the_notebook_simulates"]
    assert simulated["hip"] == pytest.approx(0.0915, rel=0.02)
    assert simulated["knee"] == pytest.approx(0.1748, rel=0.02)


def test_the_static_points_are_met_as_by_the_authors(leg):
    static = leg["static"]
    numbers = static["rms_not_at_the_stop"]
    assert f"{numbers['hip']:.4f} and {numbers['knee']:.4f} rad" in PAGE
    assert f"{static['stop']:.3f} rad" in PAGE
    assert static["stop_scatter"] < 0.02


def test_held_levels_are_the_record(leg):
    held = leg["judge"]["rigs"]["with_valves"]["held"]
    for level in held.values():
        assert " | ".join(f"{level[joint]:+.3f}" for joint in JOINTS) in PAGE


def test_the_diagnosis_is_the_record(leg):
    result = leg["diagnose"]
    assert f"`{result['verdict']}`" in PAGE
    assert not any(effect["level"] for effect in result["effects"])
    friction, valves = result["effects"]
    assert (friction["family"], valves["effect"]) == ("joint_friction", "valve_asymmetry")
    assert f"friction that is larger at rest, {100.0 * friction['share']:.0f} % of the gap" in PAGE
    assert f"(`valve_asymmetry`), {100.0 * valves['share']:.0f} %" in PAGE
    assert f"{100.0 * valves['left']:.0f} % of the gap is left" in PAGE
    for size in (s for effect in (friction, valves) for s in effect["sizes"].values()):
        assert size["interval95"][0] < 0.0 < size["interval95"][1]
