"""The blind study's cases are fixed and sound, and its scores count as stated."""

from __future__ import annotations

import json
import runpy
from pathlib import Path

import pytest

from pamsim.effects.catalog import EFFECTS, TRIAL_EFFECTS
from pamsim.twins.hidden.catalog import PLANT_EFFECTS

SCRIPTS = Path(__file__).parents[3] / "scripts"
CASES = json.loads((SCRIPTS / "blind_study_cases.json").read_text(encoding="utf-8"))["cases"]
scores = runpy.run_path(str(SCRIPTS / "blind_study_scores.py"))["scores"]


def test_cases_name_what_can_be_hidden_and_belong_to_their_tier():
    assert len({case["name"] for case in CASES}) == len(CASES)
    assert len({case["seed"] for case in CASES}) == len(CASES)
    seen = set()
    for case in CASES:
        names = list(case["effects"])
        right = [set(PLANT_EFFECTS[n].stands_for) if n in PLANT_EFFECTS else {n} for n in names]
        assert all(size > 0.0 for size in case["effects"].values())
        assert set(case["removed"]) <= set(TRIAL_EFFECTS)
        assert (case["tier"] == "nothing") == (not names)
        assert (case["tier"] == "removed") == bool(case["removed"])
        if case["tier"] == "library":
            assert set(names) <= set(EFFECTS)
        if case["tier"] in ("other_formula", "outside", "resembles"):
            assert set(names) <= set(PLANT_EFFECTS)
        if case["tier"] in ("library", "other_formula", "pair"):
            assert all(names & set(TRIAL_EFFECTS) for names in right)
        if case["tier"] in ("outside", "resembles"):
            assert not any(names & set(TRIAL_EFFECTS) for names in right)
        seen |= set(names)
    assert seen >= set(TRIAL_EFFECTS)
    assert seen >= set(PLANT_EFFECTS)


def row(tier, stands_for, verdict="named", claimed=(), **more):
    case = {"tier": tier, "name": f"{tier}{id(more)}", "removed": more.pop("removed", [])}
    hidden = [{"stands_for": names, "resembles": more.get("resembles", [])} for names in stands_for]
    return case, {
        "hidden": hidden, "verdict": verdict, "claimed": list(claimed), "certain": [],
        "suggested": list(claimed), "gap": {"before": 2.0, "after": 1.0}, "sizes": {},
        "limits": {}, "seconds": 1.0, **more,
    }  # fmt: skip


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
    assert found["wrong confident name"]["hits"] == 1
    assert found["resembles: no name, or a similar one"]["share"] == 1.0
    assert found["outside: no name claimed"]["share"] == 0.0
    assert found["removed from the library, E >= 0.5: no name claimed"]["share"] == 1.0
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


@pytest.mark.parametrize(("value", "within", "inside"), [(1.1, 1, 1), (1.2, 0, 0), (0.8, 0, 1)])
def test_sizes_and_limits_are_measured_from_neutral(value, within, inside):
    ends = [5.0 + value - 0.15, 5.0 + value + 0.25]
    size = {"value": 5.0 + value, "interval95": ends, "truth": 6.0, "neutral": 5.0}
    limit = {"limit": value, "truth": 1.0}
    found = scores([row("library", [LEAK], claimed=LEAK, sizes={"x": size}, limits={"y": limit})])
    assert found["sizes within 15 %"]["hits"] == within
    assert found["intervals that contain the hidden value"]["hits"] == inside
    assert found["limits of effects not claimed that hold"]["hits"] == (value >= 1.0)
