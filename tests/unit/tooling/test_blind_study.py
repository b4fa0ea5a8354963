"""The blind study's cases are fixed and sound, and its scores count as stated."""

from __future__ import annotations

import collections
import json
import runpy
from pathlib import Path
from types import SimpleNamespace

import pytest

from pamsim.effects.catalog import EFFECTS, TRIAL_EFFECTS
from tests.plant.hidden.catalog import PLANT_EFFECTS

SCRIPTS = Path(__file__).parents[3] / "scripts"
generator = SimpleNamespace(**runpy.run_path(str(SCRIPTS / "blind_study_cases.py")))
SCORES = runpy.run_path(str(SCRIPTS / "blind_study_scores.py"))
must_show, printed, scores = (SCORES[name] for name in ("must_show", "printed", "scores"))
CASES = json.loads(generator.FILE.read_text(encoding="utf-8"))["cases"]


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
        if case["tier"] in ("outside", "resembles"):
            assert not any(right)
        seen |= set(names)
    assert seen >= set(generator.LIBRARY)
    assert seen >= set(PLANT_EFFECTS)


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


def row(tier, stands_for, verdict="named", claimed=(), **more):
    case = {"tier": tier, "name": f"{tier}{id(more)}", "removed": more.pop("removed", [])}
    case["excess"] = {"it": more.pop("excess", 3.0)}
    more = {"physical_hidden": {}, "resembles": [], "formulation": "library", **more}
    hidden = [
        {
            "name": names[0] if names else "it", "stands_for": names,
            "families": sorted({EFFECTS[name].family for name in names}),
            "resembles": more["resembles"], "formulation": more["formulation"],
            "physical": more["physical_hidden"],
        }
        for names in stands_for
    ]  # fmt: skip
    return case, {
        "hidden": hidden, "verdict": verdict, "claimed": list(claimed), "certain": [],
        "suggested": list(claimed), "gap": {"before": 2.0, "after": 1.0}, "sizes": {},
        "limits": {}, "seconds": 1.0, "nearest": None, "physical": [], **more,
    }  # fmt: skip


def must(rows, quantity, repeats=3):
    (found,) = [r for r in must_show(rows, repeats) if r["quantity"].startswith(quantity)]
    return found


FRICTION, LEAK = ["coulomb_friction", "stribeck_friction"], ["air_leak"]


def test_claims_are_counted_as_right_wrong_and_missed():
    found = scores(
        [
            row("other_formula", [FRICTION], claimed=["coulomb_friction:dahl"]),
            row("other_formula", [FRICTION], claimed=FRICTION),
            row("pair", [FRICTION, LEAK], claimed=["air_leak", "valve_flow"]),
            row("library", [LEAK], "unexplained"),
            row("resembles", [[]], claimed=["valve_flow"], resembles=["valve_flow"]),
            row("outside", [[]], claimed=["viscous_friction"]),
            row("removed", [LEAK], "unexplained", removed=LEAK),
            row("nothing", [], "no_gap"),
        ]
    )
    f1 = found["localisation F1"]
    assert [f1[f"{kind}s"] for kind in ("true_positive", "false_positive", "false_negative")] == [
        3, 2, 2,
    ]  # fmt: skip
    assert f1["value"] == 0.6
    assert found["false discovery rate"]["share"] == 0.4
    assert found["isolation"]["hits"] == 2
    assert found["coverage"]["hits"] == 2
    assert found["detection"]["count"] == 4
    assert found["resembles: no name, or a similar one"]["share"] == 1.0
    assert found["nothing hidden: verdict no_gap"]["share"] == 1.0


def test_of_tied_models_what_all_share_is_claimed_and_the_rest_suggested():
    (hedged,) = [
        row("pair", [FRICTION, LEAK], "ambiguous", ["air_leak", "coulomb_friction"], certain=LEAK)
    ]
    found = scores([hedged])
    assert found["localisation F1"]["true_positives"] == 1
    assert found["localisation F1"]["false_negatives"] == 1
    assert found["coverage"]["share"] == 1.0
    assert found["isolation"]["share"] == 0.0


@pytest.mark.parametrize(
    ("verdict", "claimed", "more", "hits"),
    [
        ("named", [], {}, 0),
        ("named", ["air_leak"], {}, 1),
        ("named_with_remainder", ["air_leak"], {}, 1),
        ("ambiguous", ["air_leak"], {}, 0),
        ("ambiguous", ["air_leak"], {"certain": ["air_leak"]}, 1),
        ("unexplained", [], {"suggested": ["air_leak"], "nearest": "air_leak"}, 0),
    ],
)
def test_a_claim_is_a_name_with_confidence(verdict, claimed, more, hits):
    for tier, quantity in (("nothing", "claim on"), ("nothing", "wrong"), ("removed", "wrong")):
        hidden, removed = ([], []) if tier == "nothing" else ([LEAK], LEAK)
        one = row(tier, hidden, verdict, claimed, removed=removed, **more)
        assert must([one], quantity)["hits"] == hits
    for tier, quantity in (("outside", "outside"), ("removed", "true effect removed")):
        found = must([row(tier, [[]], verdict, claimed, **more)], quantity)
        assert found["hits"] == 1 - hits
        assert not found["met"]  # one case is too few


def test_what_only_resembles_is_neither_right_nor_wrong_and_a_right_name_forgives():
    similar = row("resembles", [[]], claimed=["valve_flow"], resembles=["valve_flow"])
    extra = row("pair", [FRICTION, LEAK], claimed=["air_leak", "valve_flow"])
    wrong = row("library", [LEAK], claimed=["valve_flow"])
    assert must([similar, extra, wrong], "wrong")["hits"] == 1
    found = must([similar, extra, wrong], "spurious")
    assert (found["hits"], found["count"]) == (1, 4)


def test_another_kind_of_the_right_family_is_a_right_name_but_not_the_right_kind():
    case, kind = row("library", [["viscous_friction"]], claimed=["coulomb_friction"])
    assert must([(case, kind)], "wrong")["hits"] == 0
    assert must([(case, kind)], "library's formula")["hits"] == 0
    other = ({**case, "tier": "other_formula"}, {**kind, "formulation": "a power of speed"})
    label = "another formula, E >= 0.5: right kind, of those named by the right family"
    assert (scores([other])[label]["hits"], scores([other])[label]["count"]) == (0, 1)
    right = row("other_formula", [["viscous_friction"]], claimed=["viscous_friction"])
    assert scores([right])[label]["hits"] == 1
    gone = {"removed": ["viscous_friction", "coulomb_friction"], "tier": "removed"}
    left = [name for name in TRIAL_EFFECTS if EFFECTS[name].family == "joint_friction"]
    assert must([({**case, **gone, "removed": left}, kind)], "wrong")["hits"] == 1


def test_what_belongs_to_a_family_without_a_formula_there_is_named_by_the_family():
    case, found = row("other_formula", [[]], claimed=["angle_bias"])
    assert must([(case, found)], "wrong")["hits"] == 1
    found["hidden"][0]["families"] = ["angle_sensor"]  # as of an eccentric encoder
    assert must([(case, found)], "wrong")["hits"] == 0
    assert must([(case, found)], "another formula")["hits"] == 1


def test_a_name_is_unique_and_right_or_tied_cases_are_counted_apart():
    cases = [
        row("library", [LEAK], claimed=LEAK),
        row("library", [LEAK], claimed=[*LEAK, "valve_flow"]),
        row("library", [LEAK], "ambiguous", suggested=[*LEAK, "valve_flow"]),
        row("library", [LEAK], "ambiguous", suggested=["valve_flow", "line_lag"]),
        row("library", [LEAK], "unexplained", gap={"before": 1.1, "after": None}),
    ]
    found = must(cases, "library's formula")
    assert (found["hits"], found["count"]) == (1, 3)
    apart = scores(cases)[
        "library's formula, E >= 0.5: unique correct name, tied counted as misses"
    ]
    assert (apart["hits"], apart["count"]) == (1, 4)


def test_refused_data_detect_and_claim_nothing():
    gap = {"before": None, "after": None}
    cases = [row("library", [LEAK], "refused", gap=gap)]
    assert scores(cases)["detection"]["hits"] == scores(cases)["coverage"]["hits"] == 0
    found = must(cases, "one log without", 1)
    assert (found["hits"], found["count"]) == (0, 1)


@pytest.mark.parametrize(
    ("claimed", "nearest", "hit"),
    [
        (["stribeck_friction"], None, 1),
        (["viscous_friction"], None, 1),  # of the same family
        ([], "coulomb_friction+air_leak", 1),
        ([], "muscle_hysteresis", 0),
        (["muscle_hysteresis"], "coulomb_friction", 0),  # a claim counts before a resemblance
        ([], None, 0),
    ],
)
def test_the_family_is_right_if_claimed_or_else_resembled(claimed, nearest, hit):
    verdict = "named" if claimed else "unexplained"
    one = row("other_formula", [["coulomb_friction"]], verdict, claimed, nearest=nearest)
    assert must([one], "another formula")["hits"] == hit
    for repeats, quantity in ((2, "2 repeats only"), (1, "one log without")):
        assert must([one], quantity, repeats)["hits"] == hit
    assert len(must_show([one], 3)) == len(must_show([one], 2)) - 1


def test_without_a_noise_floor_the_excess_is_that_of_the_case():
    gap = {"before": None, "after": None}
    cases = [row("other_formula", [LEAK], "unexplained", gap=gap, excess=e) for e in (0.4, 0.6)]
    assert must(cases, "another formula")["count"] == 1


def sized(value, *, claimed=("coulomb_friction",), more=(), interval=None, **other):
    entry = {"sliding_torque": {"value": value, "unit": "N*m", "interval95": interval}}
    stated = {} if value is None else entry
    found = [{"names": ["coulomb_friction"], "quantities": stated}, *more]
    truth = {"sliding_torque": {"value": 0.2, "unit": "N*m"}}
    return row(
        "other_formula", [FRICTION], claimed=claimed, physical=found, physical_hidden=truth,
        formulation="Dahl", **other,
    )  # fmt: skip


def tied_family(size):
    """A diagnosis that is certain of friction, not of its law."""
    families = {"joint_friction": {"sliding_torque": size}}
    return sized(None, claimed=(), verdict="ambiguous", families=families)


def test_size_is_that_of_the_leading_quantity_of_right_names():
    half = {"names": ["stribeck_friction"], "quantities": {"sliding_torque": {"value": 0.1}}}
    other = {"names": ["air_leak"], "quantities": {"sliding_torque": {"value": 0.1}}}
    cases = {
        "right": (sized(0.229), 1),
        "too large": (sized(0.231), 0),
        "too small": (sized(0.169), 0),
        "sum of two": (sized(0.1, more=[half]), 1),
        "not of wrong names": (sized(0.1, more=[other]), 0),
        "not named": (sized(0.2, claimed=["air_leak"]), 0),
        "tied": (sized(0.2, verdict="ambiguous", certain=["coulomb_friction"]), 0),
        "not stated": (sized(None), 0),
        "family": (tied_family({"value": 0.229, "interval95": [0.2, 0.25]}), 1),
        "family of the wrong size": (tied_family({"value": 0.24, "interval95": None}), 0),
    }
    for name, (one, hit) in cases.items():
        found = must([one], "friction and hysteresis")
        assert (found["hits"], found["count"]) == (hit, 1), name
    assert must([row("other_formula", [LEAK], claimed=LEAK)], "friction")["count"] == 0


def test_intervals_are_of_physical_sizes_and_of_parameters_of_right_names():
    def count(one):
        found = must([one], "intervals")
        return found.get("hits", 0), found["count"]

    size = {"value": 1.0, "truth": 1.0, "neutral": 0.0, "interval95": [0.9, 1.1]}
    sizes = {"x": {**size, "hidden": "coulomb_friction"}}
    assert count(sized(0.2, interval=[0.15, 0.19], sizes=sizes)) == (0, 1)
    assert count(sized(0.2, interval=[0.19, 0.21], sizes=sizes)) == (1, 1)
    assert count(tied_family({"value": 0.229, "interval95": [0.19, 0.25]})) == (1, 1)
    assert count(tied_family({"value": 0.229, "interval95": [0.21, 0.25]})) == (0, 1)
    flow = {"mass_flow": {"value": 4e-7, "unit": "kg/s"}}
    found = [
        {"names": LEAK, "quantities": {"mass_flow": {"value": 4e-7, "interval95": [3e-7, 5e-7]}}}
    ]
    laminar = {"claimed": LEAK, "formulation": "laminar", "physical_hidden": flow}
    assert count(row("other_formula", [LEAK], **laminar, physical=found)) == (1, 1)
    leak = {"x": {**size, "hidden": "air_leak"}}
    assert count(row("library", [LEAK], claimed=LEAK, sizes=leak)) == (1, 1)
    assert count(row("library", [LEAK], claimed=["valve_flow"], sizes=leak)) == (0, 0)


@pytest.mark.parametrize(
    ("first", "second", "hit"),
    [(["coulomb_friction"], LEAK, 1), (["coulomb_friction"], [], 0), ([], LEAK, 0)],
)
def test_of_pairs_with_another_formula_both_are_claimed_or_tied(first, second, hit):
    both = [*first, *second]
    one = row("pair", [FRICTION, LEAK], "ambiguous", suggested=both, formulation="Dahl")
    library = row("pair", [FRICTION, LEAK], claimed=both)
    found = must([one, library], "pairs")
    assert (found["hits"], found["count"]) == (hit, 1)


@pytest.mark.parametrize(("limit", "hit"), [(1.1, 1), (0.9, 0), (None, 1)])
def test_limits_hold_above_what_was_hidden_or_where_the_data_cannot_tell(limit, hit):
    one = row("library", [LEAK], "no_gap", limits={LEAK[0]: {"limit": limit, "truth": 1.0}})
    assert must([one], "limits")["hits"] == hit
    other = row("library", [LEAK], "no_gap", limits={"valve_flow": {"limit": 0.0, "truth": 1.0}})
    assert must([other], "limits")["count"] == 0
    stated = scores([one])["limits of absent effects that are stated"]
    assert stated["hits"] == (limit is not None)


def test_a_bar_needs_its_share_and_its_count():
    clean, claimed = row("nothing", [], "no_gap"), row("nothing", [], claimed=LEAK)
    assert not must([clean] * 59, "claim on")["met"]
    assert must([clean] * 60, "claim on")["met"]
    assert must([clean] * 59 + [claimed], "claim on")["met"]
    assert not must([clean] * 60 + [claimed] * 2, "claim on")["met"]
    slow = must([row("nothing", [], "no_gap", seconds=s) for s in (10.0, 31.0, 32.0)], "median")
    assert slow["median"] == 31.0
    assert not slow["met"]
    text = printed(must_show([clean] * 60, 3))
    assert "met     claim on data without effect: 0.0 % (0 of 60, 0.0 to 6.0 %)" in text
    assert "NOT MET outside the library: no confident name: no data; must be >= 95 %" in text


@pytest.mark.parametrize(("value", "within"), [(1.1, 1), (1.2, 0), (0.8, 0)])
def test_parameters_are_measured_from_neutral(value, within):
    size = {
        "value": 5.0 + value, "interval95": None, "truth": 6.0, "neutral": 5.0, "hidden": "x",
    }  # fmt: skip
    found = scores([row("library", [LEAK], claimed=LEAK, sizes={"x": size})])
    assert found["parameters within 15 %"]["hits"] == within
