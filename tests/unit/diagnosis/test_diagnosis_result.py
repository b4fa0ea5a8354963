"""`diagnosis.json`: the contract's keys, numbers in stated units, a sentence for every verdict."""

from __future__ import annotations

import json

import numpy as np
import pytest

import pamsim
from pamsim.diagnosis.method.evidence import compare_trials
from pamsim.diagnosis.method.verdict import Verdict
from tests.unit.diagnosis.diagnosed import NOISE, VERDICTS, following, report

CONTRACT = {
    "schema", "verdict", "effects", "resembles", "alternatives", "where", "gap", "absent",
    "warnings", "next_experiment", "seed", "versions", "rollouts", "seconds",
}  # fmt: skip


@pytest.fixture(scope="module")
def rig():
    return pamsim.load_rig("mas20_arm")


def result(rig, verdict, **more):
    return report(rig, verdict, **VERDICTS[verdict], **more).to_dict()


@pytest.mark.parametrize("verdict", list(Verdict))
def test_every_verdict_makes_a_whole_json(rig, verdict):
    found = json.loads(json.dumps(result(rig, verdict), allow_nan=False))
    assert found.keys() >= CONTRACT
    assert found["schema"] == "pamsim-diagnosis/2"
    assert found["verdict"] == verdict.value
    claims = verdict in (Verdict.NAMED, Verdict.NAMED_WITH_REMAINDER)
    assert bool(found["effects"]) is claims
    repairs = claims or verdict is Verdict.AMBIGUOUS
    assert all((gap["after"] is not None) is repairs for gap in found["gap"].values())
    assert (found["resembles"] is None) is (verdict is Verdict.NO_GAP)
    assert found["sentence"].endswith(".")
    assert found["sentence"].count(". ") <= 1
    assert (found["rollouts"], found["seed"]) == (240, 3)


def test_an_effect_has_its_numbers_in_the_rig_s_unit_and_in_si(rig):
    (effect,) = result(rig, Verdict.NAMED)["effects"]
    assert (effect["name"], effect["family"]) == ("air_leak", "leak")
    leak = effect["parameters"]["chamber.leak_conductance"]
    assert leak["value_si"] == pytest.approx(1.4e-12)
    assert (leak["value"], leak["unit"]) == (pytest.approx(1.4), "mm^3/(s*kPa)")
    assert leak["interval95"] == pytest.approx([1.26, 1.54])
    assert leak["interval95_si"] == pytest.approx([1.26e-12, 1.54e-12])
    assert effect["explained"] == pytest.approx(0.98)
    assert effect["p_value"] < 0.05


def test_an_effect_has_its_size_in_physical_terms_in_si(rig):
    fits = report(rig, Verdict.NAMED, ["air_leak"], lack=(-0.01, 0.5, 0.0001))
    (effect,) = fits.to_dict()["effects"]
    flow = effect["physical"]["mass_flow"]
    assert set(flow) == {"value", "unit", "interval95"}
    # Sonic: C times the standard density of ISO 6358 times the absolute pressure.
    assert flow["value"] == pytest.approx(1.4e-12 * 1.185 * 3.513e5, rel=1e-3)
    assert flow["unit"] == "kg/s"
    assert flow["interval95"] == pytest.approx([0.9 * flow["value"], 1.1 * flow["value"]])
    assert effect["physical"]["at_pressure"] == {"value": 2.5e5, "unit": "Pa", "interval95": None}
    two = result(rig, Verdict.AMBIGUOUS)["alternatives"]
    assert all(model["physical"] for model in two)


def test_a_size_is_less_certain_where_the_formula_leaves_something(rig):
    def width(left, unseen=0.0):
        made = report(
            rig, Verdict.NAMED_WITH_REMAINDER, ["air_leak"], left_for_certain=left,
            lack=(-0.01, 0.3, 0.0001), lack_error=unseen,
        )  # fmt: skip
        (effect,) = made.to_dict()["effects"]
        flow = effect["physical"]["mass_flow"]
        low, high = flow["interval95"]
        return flow["value"] - low, high - flow["value"], flow["value"]

    below, above, value = width(0.0)
    # The effect explains a loss of 4.1: twice the amplitude of what is left is two fifths of it.
    wide = width(4.1 / 25.0)
    assert wide[:2] == pytest.approx(
        [np.hypot(below, 0.4 * value), np.hypot(above, 0.4 * value)], rel=0.01
    )
    assert width(1e3)[0] == pytest.approx(np.hypot(below, value))  # and never more than itself
    # Nor is it more certain than the repeats could show a remainder.
    assert width(0.0, unseen=4.1 / 25.0)[:2] == pytest.approx(wide[:2])


def test_a_family_that_all_tied_models_share_is_certain_and_so_is_its_size(rig):
    sensors = report(rig, Verdict.AMBIGUOUS, ["pressure_scale"], [["pressure_lag"]])
    assert sensors.certain == ()
    assert sensors.certain_families == {"pressure_sensor": {}}  # their sizes are not comparable
    assert "an effect of the family pressure sensor is missing" in sensors.sentence
    three = report(rig, Verdict.AMBIGUOUS, ["pressure_scale"], [["pressure_lag"], ["angle_bias"]])
    assert three.certain_families == {}
    friction = report(rig, Verdict.AMBIGUOUS, ["coulomb_friction"], [["load_dependent_friction"]])
    found = friction.to_dict()["certain_families"]["joint_friction"]["sliding_torque"]
    sizes = [a["physical"]["sliding_torque"] for a in friction.to_dict()["alternatives"]]
    ends = [end for size in sizes for end in size["interval95"]]
    assert found["value"] == sizes[0]["value"]
    assert found["interval95"] == [min(ends), max(ends)]
    named = report(rig, Verdict.NAMED, ["coulomb_friction"])
    assert named.certain_families == {}


def test_each_of_two_effects_says_what_it_explains_beyond_the_other(rig):
    effects = result(rig, Verdict.NAMED_WITH_REMAINDER)["effects"]
    assert [e["name"] for e in effects] == ["air_leak", "angle_bias"]
    # Losses: 5.1 without, 2 with the leak, 3 with the bias, 1 with both.
    assert [e["explained"] for e in effects] == pytest.approx([0.7 * 2 / 4.1, 0.7 / 4.1], rel=0.01)
    assert all(0.0 < e["p_value"] < 0.05 for e in effects)


def test_p_values_are_corrected_for_all_effects_that_were_tried(rig):
    one = report(rig, Verdict.NAMED, ["air_leak"])
    (effect,) = one.to_dict()["effects"]
    best = one.method.conclusion.best
    assert effect["p_value"] == pytest.approx(2.0 * best.improvement.p_value)
    assert one.to_dict()["resembles"]["p_value"] == effect["p_value"]


def test_an_unexplained_gap_resembles_the_effect_of_most_similar_signature(rig):
    near = report(rig, Verdict.UNEXPLAINED).to_dict()["resembles"]
    assert near == {
        "name": "air_leak", "family": "leak", "explained": pytest.approx(0.81),
        "p_value": None, "similarity": 0.9, "explained_interval95": None, "leaves": None,
    }  # fmt: skip
    near = report(rig, Verdict.UNEXPLAINED, ["angle_bias"], explained=0.4).to_dict()["resembles"]
    assert (near["name"], near["family"], near["explained"]) == ("angle_bias", "angle_sensor", 0.4)
    assert near["p_value"] < 0.05


def test_gaps_are_of_the_held_out_trials_in_written_units(rig):
    gap = result(rig, Verdict.NAMED)["gap"]
    assert set(gap) == set(NOISE)
    pressure, angle = gap["pressure_1"], gap["angle"]
    assert (pressure["unit"], angle["unit"]) == ("kPa", "deg")
    assert pressure["floor"]["value"] == pytest.approx(0.4)
    assert pressure["before"]["value"] == pytest.approx(np.hypot(2.0, 0.4), rel=0.02)
    assert angle["after"]["value"] == pytest.approx(np.degrees(1e-3), rel=0.1)
    over = result(rig, Verdict.NAMED)["gap_over_floor"]
    assert over["before"] == pytest.approx(np.sqrt((26.0 + 26.0 + 17.0) / 3.0), rel=0.02)
    assert over["after"] == pytest.approx(1.0, rel=0.05)
    low, high = pressure["after"]["interval95"]
    assert low < pressure["after"]["value"] < high < pressure["before"]["value"]


def test_where_comes_with_the_region_of_the_channel_s_surest_map(rig):
    found = result(rig, Verdict.NAMED)
    first = found["where"][0]
    assert (first["channel"], first["protocol"], first["excess"]) == ("pressure_1", "swing", 20.0)
    assert first["region"] == {
        "quantity": "common_pressure", "low": 200.0, "high": 300.0, "unit": "kPa",
        "p_value": 0.001, "rows": [],
    }  # fmt: skip
    angle = next(cell for cell in found["where"] if cell["channel"] == "angle")
    assert angle["region"] is None  # no map of it is sure
    assert found["maps"][2]["mean"] == [None, 1.0]


def test_what_is_absent_is_bounded_or_stated_to_be_undetermined(rig):
    absent = result(rig, Verdict.NO_GAP)["absent"]
    tilt = absent["load_torque"]
    assert (tilt["ruled_out_above"], tilt["unit"]) == (pytest.approx(1.0), "deg")
    assert tilt["typical_sizes"] == 0.5
    assert absent["added_inertia"] == {
        "parameter": "joint.shaft.armature",
        "cannot_tell": True,
        "because": "the data do not show it",
    }


def test_loops_and_lines_of_measured_and_simulated_signals_are_told(rig):
    found = result(rig, Verdict.NAMED)
    assert {(loop["protocol"], loop["cycle"]) for loop in found["loop_areas"]} == {
        (p, c) for p in ("swing", "swing_check") for c in (1, 2)
    }  # fmt: skip
    assert {loop["repeats"] for loop in found["loop_areas"]} == {3}
    lines = {entry["channel"]: entry for entry in found["spectrum"]}
    assert lines["pressure_1"]["before"]["mean"] == pytest.approx(2.0, abs=0.1)
    assert lines["pressure_1"]["before"]["noise"] == pytest.approx(0.4, rel=0.1)
    assert lines["pressure_1"]["after"]["mean"] == pytest.approx(0.0, abs=0.1)


def test_of_a_rejected_effect_the_share_is_given_and_no_size(rig):
    made = report(rig, Verdict.UNEXPLAINED, **VERDICTS[Verdict.UNEXPLAINED])
    assert made.method.conclusion.best.intervals
    one = made.to_dict()
    assert one["effects"] == one["alternatives"] == []
    assert (one["resembles"]["name"], one["resembles"]["explained"]) == ("air_leak", 0.4)


def test_alternatives_are_told_by_how_far_they_are_behind(rig):
    made = report(rig, Verdict.AMBIGUOUS, **VERDICTS[Verdict.AMBIGUOUS])
    one = made.to_dict()
    assert [a["name"] for a in one["alternatives"]] == ["air_leak", "supply_sag", "angle_bias"]
    behind = [a["standard_errors_behind"] for a in one["alternatives"]]
    named = made.method.conclusion
    protocol_of = dict.fromkeys(named.best.loss, "swing_check")
    expected = compare_trials(named.tied[0].loss, named.best.loss, protocol_of)
    assert behind == pytest.approx([0.0] + [expected.gain / expected.error] * 2)
    assert result(rig, Verdict.NAMED)["alternatives"] == []


@pytest.mark.parametrize(
    ("verdict", "words"),
    [
        (Verdict.NO_GAP, ["No gap", "as near to the measurements as their noise allows (RMS 4."]),
        (
            Verdict.NAMED,
            [
                "Missing: a leak of air from the muscles (air_leak, leak conductance 1.4"
                " [1.26, 1.54] mm^3/(s*kPa))",
                "it explains 98 [92, 99] % of the gap",
                "times the noise floor before and 0.9",
            ],
        ),
        (
            Verdict.NAMED_WITH_REMAINDER,
            ["Missing: something that resembles a leak of air from the muscles (air_leak",
             "and an error of the angle sensor, best described as an offset of the angle"
             " sensor (angle_bias, angle bias 0.401", "together they"
             " explain 70 [64, 71] % of the gap, and leave 0.02 of the noise variance, shared by"
             " all repeats (p = 0.0003): another effect, of the same family (leak,"
             " angle sensor) or one that resembles it"],
        ),
        (
            Verdict.AMBIGUOUS,
            ["cannot decide whether it is a leak of air from the muscles (air_leak), a supply",
             "or an offset of the angle sensor (angle_bias)", "shut the valves at a high pressure"],
        ),
        (
            Verdict.UNEXPLAINED,
            ["none of the 2 effects tried explains", "air_leak resembles it most, with 40 [34,",
             "of the gap, and leaves most in angle of swing_check; the gap is",
             "largest in pressure 1 of swing"],
        ),
        (
            Verdict.NOT_IDENTIFIABLE,
            ["too few trials repeat", "three times or more", "air_leak resembles it most"],
        ),
    ],
)  # fmt: skip
def test_the_verdict_is_one_plain_sentence(rig, verdict, words):
    sentence = result(rig, verdict)["sentence"]
    for part in words:
        assert part in sentence


def test_a_remainder_that_repeats_need_not_share_is_stated_by_its_size(rig):
    one = report(rig, Verdict.NAMED_WITH_REMAINDER, ["air_leak"], lack=(0.02, 0.3, 1e-4))
    assert "and leaves 0.01 of the noise variance: another effect, of the same" in one.summary()


def test_a_remainder_that_repeats_cannot_show_is_said_to_be_untested(rig):
    one = report(rig, Verdict.NAMED_WITH_REMAINDER, ["air_leak"], lack=(0.02, 0.25, 0.25))
    assert "resembles it is not testable with these repeats" in one.summary()
    assert "and leaves" not in one.summary()
    assert one.details.lack_of_fit["testable"] is False


@pytest.mark.parametrize(
    ("lack", "words"),
    [
        ((0.02, 0.3, 1e-4), "times the noise floor)."),
        ((0.02, 3e-4, 1e-4), "share 0.02 of the noise variance that it does not predict (p = 0.0"),
        ((0.02, 0.25, 0.25), "whether all repeats share a remainder is not testable with these"),
    ],
)  # fmt: skip
def test_no_gap_says_what_repeats_share_and_whether_they_could_show_it(rig, lack, words):
    assert words in report(rig, Verdict.NO_GAP, lack=lack).summary()


@pytest.mark.parametrize("verdict", [Verdict.NO_GAP, Verdict.UNEXPLAINED, Verdict.NOT_IDENTIFIABLE])
def test_a_nuisance_parameter_at_its_bound_or_far_from_the_rig_is_announced(rig, verdict):
    """It may have taken the place of what is missing."""
    bound = report(rig, verdict, at_bound=("force.scale",))
    assert "refitted far from the rig: force.scale to 0.97 (the end of its range; the rig: 1)" in (
        bound.summary()
    )
    far = report(rig, verdict, refitted=1.3)
    assert "refitted far from the rig: force.scale to 1.3 (the rig: 1)." in far.summary()
    assert far.to_dict()["nuisance"][0]["far"] is True
    near = report(rig, verdict)
    assert "refitted far" not in near.summary()
    assert near.to_dict()["nuisance"][0]["far"] is False


def test_what_all_alternatives_share_is_certain(rig):
    one = report(rig, Verdict.AMBIGUOUS, ["air_leak", "angle_bias"], [["air_leak", "angle_scale"]])
    assert one.certain == ("air_leak",)
    assert "Ambiguous: air_leak is missing, and these data cannot decide" in one.summary()
    assert "an offset of the angle sensor (angle_bias) or" in one.summary()


def test_a_diagnosis_saves_its_json_and_the_repaired_rig(rig, tmp_path):
    one = report(rig, Verdict.NAMED, ["air_leak"])
    paths = one.save(tmp_path)
    found = json.loads((tmp_path / "diagnosis.json").read_text(encoding="utf-8"))
    assert paths == [tmp_path / "diagnosis.json", tmp_path / "rig"]
    assert found == {**one.to_dict(), "repaired_rig": str(tmp_path / "rig")}
    assert one.summary() == found["sentence"]


def test_the_experiment_that_would_decide_is_said(rig):
    found = result(rig, Verdict.AMBIGUOUS, following=following())
    assert (
        "recording shut_hold would decide (what leaves a chamber whose valves are shut)"
        in found["sentence"]
    )
    assert "it separates them by 7.1 of the noise variance, these data by 0.3" in found["sentence"]
    assert found["next_experiment"]["menu"] == {"shut_hold": 7.1, "bursts": 2.0}


def test_an_unexplained_gap_without_a_model_names_the_nearest_trace(rig):
    sentence = report(rig, Verdict.UNEXPLAINED).summary()
    assert "air_leak resembles it most (similarity 0.90)" in sentence


def test_signals_of_every_compared_channel_go_to_the_page(rig):
    found = report(rig, Verdict.NAMED, ["air_leak"]).comparisons
    assert len(found) == 6 * len(NOISE)
    assert all(part.after is not None for part in found)
    unexplained = report(rig, Verdict.UNEXPLAINED, ["air_leak"]).comparisons
    assert all(part.after is None for part in unexplained)  # a resemblance is no repair
