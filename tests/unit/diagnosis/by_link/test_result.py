"""The result of a diagnosis by link: no more than is certain, in words and in one word."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import pamsim
from pamsim.comparison.effects_on_rig import candidate, rig_effect
from pamsim.comparison.links import JOINT, MUSCLE, VALVES, Link
from pamsim.diagnosis.by_link.effect_entry import InsteadEntry, SuspectEntry
from pamsim.diagnosis.by_link.entries import chain_values, far_from_stated, suspect_entries
from pamsim.diagnosis.by_link.limits import Remainder, nothing_material
from pamsim.diagnosis.by_link.result import RowEntry
from pamsim.diagnosis.by_link.sizes import Size
from pamsim.diagnosis.by_link.whole_chain import ChannelGap, misses_more, slow_errors
from pamsim.report.link_page import write_link_diagnosis
from tests.unit.diagnosis.by_link.reports import LEAK, VERDICTS, effect, report, size


@pytest.mark.parametrize("verdict", list(VERDICTS))
def test_effects_and_what_is_left_come_to_a_verdict(verdict):
    assert VERDICTS[verdict].verdict.value == verdict


def test_an_effect_whose_place_is_open_leaves_the_others_certain():
    assert report(effect("")).verdict.value == "unexplained"
    assert report(effect("form"), effect("")).verdict.value == "ambiguous"
    assert report(effect("form"), effect(""), more_left=True).verdict.value == "ambiguous"


@pytest.mark.parametrize(
    ("level", "exact", "expected"),
    [
        (
            "form",
            True,
            "Certain: a leak of air from the muscles (air_leak),"
            " leak conductance 1.98 [1.92, 2.07] mm^3/(s*kPa).",
        ),
        ("name", True, "Certain: air leak, mass flow 0.5 [0.45, 0.55] mg/s. Nearest formula: "),
        (
            "family",
            False,
            "Certain: a leak of air from the muscles, mass flow 0.5 [0.45, 0.55] mg/s."
            " Nearest formula: ",
        ),
        ("place", True, "Certain: something at the valves and the air. Nearest formula: air_leak"),
        ("", True, "Not certain in its place: something in valves and air. Nearest formula: "),
    ],
)
def test_a_sentence_goes_as_deep_as_the_name_holds(level, exact, expected):
    sentence = effect(level, exact=exact).sentence
    assert sentence.startswith(expected)
    assert ("not exact: 6 % left" in sentence) is not exact


def test_the_nearest_formula_has_all_that_measures_it_and_no_shape():
    """All of a friction that grows at rest may be in what grows."""
    sizes = {
        "friction.coulomb_force": size(0.34, (0.0, 0.8), "N"),
        "friction.dwell_force": size(23.3, (20.8, 28.4), "N"),
        "friction.dwell_time": size(0.68, (0.37, 1.1), "s"),
    }
    measured_by = ("friction.coulomb_force", "friction.dwell_force")
    grown = replace(effect("family"), sizes=sizes, measured_by=measured_by)
    both = "air_leak, coulomb force 0.34 [0, 0.8] N, dwell force 23.3 [20.8, 28.4] N."
    assert grown.sentence.endswith(f"Nearest formula: {both}")


def test_a_number_of_the_rig_that_may_be_off_instead_is_stated_with_what_to_do():
    number = InsteadEntry(
        parameter="chamber.dead_volume", unit="cm^3", stated=10.0, value=18.574, share=0.9991
    )
    open_effect = replace(effect(""), instead=number)
    assert open_effect.sentence.endswith(
        " Or chamber.dead_volume is 18.6 cm^3 instead of 10, which explains 100 % of this"
        " effect: measure this number, then leave it out of --nuisance."
    )
    assert "dead_volume" not in replace(effect("family"), instead=number).sentence


def test_one_cause_of_two_sensors_errors_is_stated_on_the_page_too(tmp_path):
    found = report(replace(effect(""), upstream="line_lag"))
    assert found.effects[0].sentence.endswith(
        "such as line_lag, may explain it and the other sensor's error."
    )
    page = write_link_diagnosis(found.to_dict(), found.comparisons, tmp_path)
    assert "One cause before the sensors, such as line" in page.read_text(encoding="utf-8")


def test_what_is_left_is_stated_beside_what_was_found():
    sentence = VERDICTS["named_with_remainder"].sentence
    assert sentence.endswith(
        "Something more is missing in muscle and joint (0.4 of the noise variance)."
    )
    far = VERDICTS["unexplained"]
    assert "Unexplained: something is missing in muscle" in far.sentence
    much = tuple(replace(one, left=338.2) if one.more_left else one for one in far.links)
    assert "muscle and joint (338 of the noise variance)" in replace(far, links=much).sentence


def test_what_no_repeats_decide_is_no_agreement():
    alone, beside = report(more_left=None), report(effect("family"), more_left=None)
    assert "No gap" not in alone.sentence
    assert "No effect tried is certain. The misfit exceeds the noise estimate" in alone.sentence
    assert "muscle and joint (0.4). What is held out does not show" in beside.sentence
    one = SuspectEntry(
        effect="coulomb_friction:rigid",
        missing="dry friction at the joint",
        sizes={"joint.shaft.frictionloss": size(0.28, (0.26, 0.30), "N*m")},
    )
    condition = "If it is dry friction at the joint: frictionloss 0.28 [0.26, 0.3] N*m"
    assert condition in replace(alone, suspected=(one,)).sentence
    assert condition not in replace(VERDICTS["no_gap"], suspected=(one,)).sentence
    assert beside.verdict.value == "ambiguous"
    # Every input may have been repeated, and too few trials held out: the warnings state which.
    assert "Without repeats" not in alone.sentence
    assert alone.to_dict()["links"][1]["more_left"] is None
    assert "more than the estimated noise is left" in "\n".join(alone.lines())
    known, alone = (
        Remainder(excess=0.4, p_value=1.0),
        Remainder(excess=0.4, p_value=1.0, known=False),
    )
    assert alone.undecided
    assert not known.undecided
    small = replace(alone, excess=0.04)
    assert not small.undecided
    # Parts of trials exclude nothing, and yet the verdict is that nothing is left.
    assert nothing_material([small, replace(known, excess=-0.1)])
    assert not nothing_material([small, alone])
    assert not nothing_material([small, replace(known, p_value=0.01)])


def test_readings_that_nothing_predicts_may_be_scatter_unless_points_were_read_twice():
    rows = tuple(
        RowEntry(
            row=f"row {k}",
            pressure_kpa=(100.0 * k, 0.0),
            load_kg=0.0,
            angle_deg=10.0,
            before_deg=4.1,
            after_deg=None,
        )
        for k in range(10)
    )

    def found(before, floor, rows=rows):
        gap = ChannelGap(unit="deg", floor=floor, before=before, after=None)
        return replace(VERDICTS["no_gap"], rows=rows, gap={"angle_at_rest": gap})

    missed = found(4.1, 0.04)
    assert missed.verdict.value == "undecided"
    assert "(angle at rest by 4.1 deg RMS, 102 times its resolution)" in missed.sentence
    assert found(0.045, 0.04).verdict.value == "no_gap"
    assert found(0.06, 0.04).verdict.value == "undecided"
    assert found(4.1, None).verdict.value == "undecided"
    assert found(4.1, 0.04, (*rows, *rows)).verdict.value == "no_gap"


def test_json_has_the_rivals_that_tie_and_what_is_left():
    result = json.loads(json.dumps(report(effect("place", ties=True)).to_dict(), allow_nan=False))
    assert result["schema"] == "pamsim-diagnosis/3"
    assert result["alternatives"] == {"air_leak": ["supply_sag"]}
    assert result["remainder"] == {}
    assert result["links"][0]["floor"] == 1.0
    assert VERDICTS["named_with_remainder"].to_dict()["remainder"] == {"muscle and joint": 0.4}
    assert VERDICTS["named"].to_dict()["alternatives"] == {}


def test_a_rig_is_written_where_effects_were_found(tmp_path):
    for verdict, one in VERDICTS.items():
        paths = one.save(tmp_path / verdict)
        assert (tmp_path / verdict / "rig" in paths) is bool(one.effects)
    rig = pamsim.load_rig(tmp_path / "ambiguous" / "rig")
    leaks = [muscle.chamber.leak_conductance for muscle in rig.muscles.values()]
    assert leaks == pytest.approx([2e-12, 2e-12])


def test_a_rig_has_the_nuisance_values_of_the_links_that_its_parts_lie_in():
    air, muscle, whole = Link((VALVES,)), Link((MUSCLE,)), Link((MUSCLE, JOINT))
    local = {"valves and air": 1.2, "muscle": 1.01, "muscle and joint": 1.04}

    def model(factor):
        values = {f"force.scale in {name}": factor * value for name, value in local.items()}
        return SimpleNamespace(
            values={**values, "chamber.dead_volume in valves and air": factor * 1e-5, LEAK: 2e-12},
            sensitivities={
                "force.scale in valves and air": np.full(9, 100.0),
                "force.scale in muscle": np.array([1.0, 1.0]),
                "force.scale in muscle and joint": np.array([2.0]),
            },
        )

    fitted, base = model(1.0), model(1.1)
    found = SimpleNamespace(
        links=(air, muscle, whole),
        base=base,
        model=fitted,
        whole=None,
        shape=None,
        effects=[SimpleNamespace(links={muscle, whole})],
    )
    values = chain_values(found, fitted)
    assert values["force.scale"] == pytest.approx((2.0 * 1.01 + 4.0 * 1.04) / 6.0)
    assert values["chamber.dead_volume"] == pytest.approx(1.1e-5)  # no effect there: the base's
    assert values[LEAK] == 2e-12
    found.whole = SimpleNamespace(values={"force.scale in whole chain": 1.02, LEAK: 3e-12})
    assert chain_values(found, fitted) == {"force.scale": 1.02, LEAK: 3e-12}
    assert chain_values(found, base)[LEAK] == 2e-12
    learned = model(0.9)
    # No curve there: the model's without any, which may have fewer effects than that of the search.
    found.shape = SimpleNamespace(model=learned, links=(whole,), rest=model(1.05))
    shaped = chain_values(found, learned)
    assert shaped["force.scale"] == pytest.approx((2.0 * 1.05 * 1.01 + 4.0 * 0.9 * 1.04) / 6.0)
    assert shaped["chamber.dead_volume"] == pytest.approx(1.05e-5)


def test_a_refitted_parameter_far_from_what_the_rig_states_is_in_the_warnings():
    (near,) = report().nuisance
    far = replace(near, parameter="chamber.dead_volume", stated=2e-5, whole=3.8e-5)
    assert far_from_stated([near, replace(far, whole=3.1e-5)]) == ()
    (sentence,) = far_from_stated([near, far])
    assert sentence.startswith("chamber.dead_volume was refitted to 1.9 times what the rig states")


def test_suspects_are_named_only_where_something_is_left():
    rig = pamsim.load_rig("mas20_arm")
    friction = candidate(rig, rig_effect(rig, "coulomb_friction:rigid"))
    (parameter,) = friction.parameters
    left = {"more": (True, False), "unknown": (False, True), "none": (False, False)}
    for counts, undecided in left.values():
        remainder = SimpleNamespace(undecided=undecided, counts=counts)
        found = SimpleNamespace(
            suspected=(friction,),
            sizes={parameter.name: Size(value=0.1, interval95=(0.05, 0.15))},
            unexplained={"link": remainder},
        )
        entries = suspect_entries(rig, found)
        assert bool(entries) is (counts or undecided)
        for one in entries:
            assert one.effect == "coulomb_friction:rigid"
            assert one.sizes[parameter.name].interval95 == (0.05, 0.15)


def test_channels_are_missed_by_more_together_in_noise_floors():
    def gap(floor, before, after):
        return ChannelGap(unit="deg", floor=floor, before=before, after=after)

    less, more = gap(1.0, 3.0, 2.0), gap(10.0, 10.0, 30.0)
    assert misses_more({"angle": less, "force": more})
    assert not misses_more({"angle": less, "force": gap(100.0, 10.0, 30.0)})
    assert not misses_more({"angle": less, "force": gap(None, 1.0, 9.0)})
    assert not misses_more({"angle": gap(1.0, 3.0, None)})


def test_slow_errors_of_the_whole_chain_are_stated_in_noise_floors():
    def gap(floor, before, after=None):
        return ChannelGap(unit="deg", floor=floor, before=before, after=after)

    assert slow_errors({"angle": gap(0.05, 0.099), "force": gap(0.05, 1.0, 0.06)}) == ()
    assert slow_errors({"angle": gap(None, 1.0), "force": gap(1.0, None)}) == ()
    (note,) = slow_errors({"angle": gap(0.05, 1.0, 0.13), "force": gap(2.0, 5.0)})
    assert "misses angle by 2.6, force by 2.5 noise floors" in note
