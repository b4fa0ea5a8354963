"""The study of the diagnosis by link draws its cases as stated, and counts as stated."""

from __future__ import annotations

import re
from itertools import combinations

import pytest

from tests.records import page, recorded, script

FRICTION, LEAK = ["coulomb_friction", "stribeck_friction"], ["air_leak"]
FAMILIES = {"coulomb_friction": "joint_friction", "air_leak": "leak", "valve_flow": "valve"}
PLACES = {"coulomb_friction": "joint", "air_leak": "air", "valve_flow": "air"}


@pytest.fixture(scope="module")
def drawn():
    return script("link_study_cases")


@pytest.fixture(scope="module")
def must_show():
    return script("link_study_scores").must_show


def test_the_table_of_the_document_is_that_of_the_record():
    scores, text = script("link_study_scores"), page("validation")
    record, fresh = recorded("results/link_study"), recorded("results/link_study_fresh")
    assert "\n".join(scores.table({"rules before": record, "these rules": fresh})) in text
    for one in (record, fresh):
        assert scores.must_show(one["rows"]) == one["must_show"]
    cases = recorded("link_study_cases")["cases"]
    drawn = {case["name"]: case["seed"] for case in cases}
    assert all(drawn[row["name"]] == row["seed"] for row in fresh["rows"])
    count = f"the first {len(fresh['rows'])} of {len(cases)} cases"
    assert count in " ".join(text.split())
    (paragraph,) = [one for one in text.split("\n\n") if one.startswith("*Outside the library*")]
    (wrong,) = [one for one in record["must_show"] if one["quantity"].startswith("wrong at")]
    named = re.findall(r"\d+", " ".join(re.findall(r"\((?:cases )?([\d,\s]+)\)", paragraph)))
    assert sorted(named) == sorted(name.partition("_")[0] for name in wrong["others"])


def test_effects_together_are_of_different_families_on_the_sides_of_their_tier(drawn):
    cases = drawn.planned()
    assert len({case["seed"] for case in cases}) == len(cases)
    for case in cases:
        effects = list(case["effects"])
        families = [drawn.families(effect) for effect in effects]
        assert not any(one & other for one, other in combinations(families, 2))
        air = sum(map(drawn.of_air, effects))
        sides = {"two_links": air == 1, "one_link": air in (0, 2), "three": air in (1, 2)}
        assert sides.get(case["tier"], True), case["name"]


def effect(label, level, place=None):
    name = label.partition(":")[0]
    return {
        "label": label,
        "level": level,
        "family": FAMILIES[name],
        "place": place or PLACES[name],
        "parameters": [f"{name}.size"],
    }


def row(tier, hidden=(), effects=(), **more):
    families = {"coulomb_friction": "joint_friction", "air_leak": "leak"}
    return {
        "tier": tier,
        "name": tier,
        "removed": [],
        "hidden": [
            {
                "name": names[0] if names else more["name"],
                "formulation": "library",
                "stands_for": names,
                "families": [families[names[0]]] if names else [],
                "resembles": [],
            }
            for names in hidden
        ],
        "links": {},
        "effects": list(effects),
        "truth": {},
        "sizes": {},
        **more,
    }


def hits(rows, must_show, quantity):
    (found,) = [one for one in must_show(rows) if one["quantity"].startswith(quantity)]
    return found.get("hits", 0), found["count"]


@pytest.mark.parametrize(
    ("found", "wrong"),
    [
        (effect("coulomb_friction:lugre", "name"), 0),
        (effect("valve_flow", ""), 0),
        (effect("valve_flow", "place"), 1),
        (effect("coulomb_friction", "family"), 0),
        (effect("coulomb_friction", "family", place="muscle"), 1),
    ],
)
def test_what_is_certain_is_wrong_at_its_own_level(must_show, found, wrong):
    one = row("other_formula", [FRICTION], [found])
    assert hits([one], must_show, "wrong at the level") == (wrong, 1)


def test_another_effect_of_the_right_family_is_wrong_if_its_name_is_certain(must_show):
    viscous = {**effect("coulomb_friction", "name"), "label": "viscous_friction"}
    assert hits([row("library", [FRICTION], [viscous])], must_show, "wrong at") == (1, 1)
    viscous["level"] = "family"
    assert hits([row("library", [FRICTION], [viscous])], must_show, "wrong at") == (0, 1)


def test_all_of_two_and_two_of_three_have_to_be_certain(must_show):
    both = [effect("coulomb_friction", "family"), effect("air_leak", "form")]
    pair = row("two_links", [FRICTION, LEAK], both)
    half = row("two_links", [FRICTION, LEAK], both[:1])
    assert hits([pair, half], must_show, "two effects, different") == (1, 2)
    three = row("three", [FRICTION, LEAK, []], both, name="added_inertia")
    assert hits([three], must_show, "three effects") == (1, 1)
    extra = row("three", [FRICTION, LEAK], [*both, effect("valve_flow", "family")])
    assert hits([extra], must_show, "three effects") == (0, 1)


def test_a_place_is_certain_by_an_effect_or_by_what_is_left_in_its_link(must_show):
    def link(name, left):
        return {name: {"more_left": left}}

    found = {
        "effect": row("outside", [[]], [effect("coulomb_friction", "place")], name="soft_stop"),
        "left": row("outside", [[]], name="soft_stop", links=link("muscle and joint", True)),
        "elsewhere": row("outside", [[]], name="soft_stop", links=link("valves and air", True)),
        "nothing": row("outside", [[]], name="soft_stop", links=link("muscle and joint", False)),
    }
    placed = {k: hits([r], must_show, "outside the library: place") for k, r in found.items()}
    assert placed == {"effect": (1, 1), "left": (1, 1), "elsewhere": (0, 1), "nothing": (0, 1)}
    named = row("outside", [[]], [effect("coulomb_friction", "family")], name="soft_stop")
    assert hits([named], must_show, "outside the library: a wrong") == (1, 1)


def test_a_removed_family_is_right_for_nobody(must_show):
    gone = row("removed", [FRICTION], [effect("coulomb_friction", "family")])
    gone["removed"] = [*FRICTION, "viscous_friction", "load_dependent_friction"]
    assert hits([gone], must_show, "wrong at the level") == (1, 1)


@pytest.mark.parametrize(("value", "close", "held"), [(1.1, 1, 1), (1.2, 0, 0)])
def test_a_size_counts_from_neutral_where_the_name_is_certain(must_show, value, close, held):
    more = {
        "truth": {"coulomb_friction.size": [1.0, 0.0, "coulomb_friction"]},
        "sizes": {"coulomb_friction.size": [value, [value - 0.15, value + 0.15]]},
    }
    one = row("library", [FRICTION], [effect("coulomb_friction", "name")], **more)
    assert hits([one], must_show, "size within") == (close, 1)
    assert hits([one], must_show, "intervals that hold what was hidden, library") == (held, 1)
    less = row("library", [FRICTION], [effect("coulomb_friction", "family")], **more)
    assert hits([less], must_show, "size within") == (0, 0)
    wide = {**more, "sizes": {"coulomb_friction.size": [value, [-0.1, value + 1.0]]}}
    one = row("library", [FRICTION], [effect("coulomb_friction", "name")], **wide)
    assert hits([one], must_show, "size within") == (0, 0)
