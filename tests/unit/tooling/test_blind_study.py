"""The cases that the rules of the diagnosis were made with are fixed and sound."""

from __future__ import annotations

import collections

from pamsim.effects.catalog import EFFECTS, TRIAL_EFFECTS
from tests.plant.hidden.catalog import PLANT_EFFECTS
from tests.records import recorded, script

generator, CASES = script("blind_study_cases"), recorded("blind_study_cases")["cases"]


def test_cases_name_what_can_be_hidden_and_belong_to_their_tier():
    assert len({case["name"] for case in CASES}) == len(CASES)
    assert len({case["seed"] for case in CASES}) == len(CASES)
    tried = {EFFECTS[name].family for name in TRIAL_EFFECTS}
    seen = set()
    for case in CASES:
        names = list(case["effects"])
        right = [generator.families(name) for name in names]
        gone = {EFFECTS[name].family for name in case["removed"]}
        assert all(size > 0.0 for size in case["effects"].values())
        assert set(case["removed"]) <= set(TRIAL_EFFECTS)
        assert (case["tier"] == "nothing") == (not names)
        assert (case["tier"] == "removed") == bool(case["removed"])
        if case["tier"] == "removed":
            left = set(TRIAL_EFFECTS) - set(case["removed"])
            assert right[0] <= gone
            assert not gone & {EFFECTS[name].family for name in left}
        if case["tier"] == "library":
            assert set(names) <= set(EFFECTS)
        if case["tier"] in ("other_formula", "outside", "resembles"):
            assert set(names) <= set(PLANT_EFFECTS)
        if case["tier"] in ("library", "other_formula", "pair"):
            assert all(families & tried for families in right)
        if case["tier"] in ("outside", "resembles") and names != ["ageing_drift"]:
            assert not any(right)  # ageing is the library's softening since
        seen |= set(names)
    assert seen >= set(generator.LIBRARY)
    added_since = {
        "detent", "power_pressure_scale", "round_teeth", "stiffening_spring", "unequal_channels"
    }  # fmt: skip
    assert seen >= set(PLANT_EFFECTS) - added_since


def test_cases_are_those_that_the_generator_draws():
    for case, plan in zip(CASES, generator.planned(), strict=True):
        assert {**case, "effects": list(case["effects"]), "excess": {}} == {
            **plan, "effects": list(plan["effects"]), "excess": {}
        }  # fmt: skip


def test_sizes_leave_the_excess_that_was_drawn_or_are_the_nearest_that_the_generator_has():
    off = []
    for case, plan in zip(CASES, generator.planned(), strict=True):
        for effect, drawn in plan["effects"].items():
            low, high = generator.RANGES[plan["tier"]]
            assert low <= drawn <= high
            size, left = case["effects"][effect], case["excess"][effect]
            if not 0.95 * drawn <= left <= 1.05 * drawn:
                assert size == (generator.MIDDLE if left > drawn else generator.GRID[-1])
                off.append(case["name"])
    assert len(off) <= 0.08 * len(CASES), off


def test_there_are_enough_cases_of_each_kind():
    count = collections.Counter(case["tier"] for case in CASES)
    assert count["nothing"] >= 60
    assert count["library"] >= len(generator.LIBRARY) >= 30
    assert count["outside"] >= 30
    assert count["removed"] >= 30
    assert len(CASES) >= 200
    strong = [
        next(iter(case["effects"]))
        for case in CASES
        if case["tier"] == "other_formula" and sum(case["excess"].values()) >= 1.0
    ]
    kinds = {"joint_friction", "muscle_hysteresis"}
    assert len(strong) >= 80
    assert sum(bool(generator.families(name) & kinds) for name in strong) >= 40
    others = [c for c in CASES if c["tier"] == "pair" and set(c["effects"]) & set(PLANT_EFFECTS)]
    assert len(others) >= 24


def test_any_beginning_is_a_fair_sample():
    """No tier is further ahead or behind than a random order puts it, less than 1 in 1000."""
    for tier in {case["tier"] for case in CASES}:
        total = sum(case["tier"] == tier for case in CASES)
        for k in range(1, len(CASES) + 1):
            seen = sum(case["tier"] == tier for case in CASES[:k])
            assert abs(seen / total - k / len(CASES)) < 1.95 / total**0.5
