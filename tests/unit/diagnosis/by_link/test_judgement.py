"""What a search fits, what a judgement counts, and which rivals it fits: rows that are exact."""

from collections import Counter

import numpy as np
import pytest

from pamsim.diagnosis.by_link import judge, search
from pamsim.diagnosis.by_link.promise import promises
from tests.unit.diagnosis.by_link.toy_chain import AIR, ARMLINK, STEPS, tried
from tests.unit.diagnosis.by_link.toy_rows import judgement, rows

DELAY, SLEW, LAG, FRICTION, SAG, HYSTERESIS, ASYMMETRY, STRIBECK = (
    tried(name)[0]
    for name in (
        *("valve_delay", "valve_slew", "pressure_lag", "viscous_friction"),
        *("supply_sag", "valve_hysteresis", "valve_asymmetry", "stribeck_friction"),
    )
)
(LEAK, OTHER_LEAK), (LINE, OTHER_LINE) = tried("air_leak"), tried("line_lag")


def judged(shapes, missing, *effects, **options):
    """What is found of every effect by name, and labels of the rivals that were fitted."""
    case, searched, begun = judgement(shapes, missing, *effects, **options)
    _, found = judge.judge(searched, case.unseen)
    return {one.effect.name: one for one in found}, begun


THREE = [
    (DELAY, rows(air_0=1.0)),
    (LAG, rows(air_1=1.0, arm_1=3.0)),  # seen in both links, three times as much in the second
    (FRICTION, rows(arm_0=1.0)),
]
MISSING = 5.0**0.5 * THREE[0][1] + THREE[1][1] + 2.0**0.5 * THREE[2][1]


def test_a_gain_is_the_mean_fall_of_the_links_in_which_an_effect_is_seen():
    found, _ = judged(THREE, MISSING, *(one for one, _ in THREE))
    for name, by_link, before in (
        ("valve_delay", {AIR: 5.0}, 6.0),
        ("pressure_lag", {AIR: 1.0, ARMLINK: 3.0}, 5.5),
        ("viscous_friction", {ARMLINK: 2.0}, 5.0),
    ):
        one = found[name]
        assert one.by_link == pytest.approx(by_link)
        assert one.links == set(by_link)
        assert one.gain == pytest.approx(np.mean(list(by_link.values())))
        assert one.before == pytest.approx(before)
        assert (one.missed, one.left, one.uncounted, one.error) == pytest.approx((0.0,) * 4)
        assert one.exact


def test_what_is_left_counts_as_far_as_an_effect_is_seen_there_on_the_scale_of_its_gain():
    def lag(p_value=0.001, **left):
        effects = [one for one, _ in THREE]
        return judged(THREE, MISSING + rows(**left), *effects, p_value=p_value)[0]["pressure_lag"]

    # In both links, three times as much in the second, as the effect: the mean, as the gain is.
    assert lag(air_2=0.1, arm_2=0.3).missed == pytest.approx(0.2)
    assert lag(air_2=0.4).missed == pytest.approx(0.8 * 0.25 * 0.4)
    assert lag(arm_2=0.4).missed == pytest.approx(0.8 * 0.75 * 0.4)
    certain, unsure = lag(arm_2=0.4), lag(0.3, arm_2=0.4)
    missed = certain.missed
    assert (certain.left, certain.uncounted) == pytest.approx((missed, 0.0))
    assert (unsure.left, unsure.missed, unsure.uncounted) == pytest.approx((0.0, 0.0, missed))
    assert (certain.exact, unsure.exact) == (False, True)


@pytest.mark.parametrize(("left", "named"), [(0.049, True), (0.052, False)])
def test_a_name_is_certain_beside_a_hundredth_of_what_the_effect_takes_away(left, named):
    (found,) = judged(THREE, rows(air_0=5.0, air_2=left), DELAY)[0].values()
    assert (found.named, found.exact) == (named, left < 0.05)


def test_the_error_of_a_formula_is_a_tenth_of_what_it_takes_away_in_the_links_of_another():
    effects = [one for one, _ in THREE]
    found, _ = judged(THREE, MISSING + rows(arm_2=0.4), *effects)
    # The delay's formula is exact, and the friction and the delay share no link.
    errors = {"valve_delay": 0.1 * 1.0, "viscous_friction": 0.1 * 3.0, "pressure_lag": 0.1 * 1.0}
    assert {name: one.error for name, one in found.items()} == pytest.approx(errors)


def test_what_another_formula_of_a_family_would_take_is_left_to_no_unknown_cause():
    """But for the standard error of what is left: here a tenth is known no better."""
    # With this sign it promises nothing.
    shapes = [(DELAY, rows(air_0=1.0)), (SLEW, rows(air_1=1.0)), (FRICTION, rows(arm_0=1.0))]
    missing = rows(air_0=90.0, air_1=-4.5, arm_0=9.0, arm_1=0.4)
    found, _ = judged(shapes, missing, DELAY, FRICTION)
    assert found["valve_delay"].missed == pytest.approx(4.5)
    assert found["valve_delay"].left == pytest.approx(0.1 * 4.5)
    assert found["viscous_friction"].left == found["viscous_friction"].missed == pytest.approx(0.4)


def test_what_is_not_needed_is_taken_out_one_by_one_the_least_needed_first():
    """Each of two similar ones is not needed beside the other, but one is needed."""
    shapes = [(DELAY, rows(air_0=1.0)), (LEAK, rows(air_0=1.0, air_1=0.01))]
    for sizes, name in (((1.0, 0.001), "valve_delay"), ((1.0, 0.01), "air_leak")):
        found, _ = judged(shapes, rows(air_0=sizes[0], air_1=sizes[1]), DELAY, LEAK)
        assert set(found) == {name}
    assert judged(shapes, rows(air_0=0.09), DELAY, LEAK)[0] == {}


def resembling(cosine_squared, number):
    """A shape that promises a share of what that of the first row of the air does."""
    return rows(air_0=cosine_squared) + rows(**{f"air_{number}": 1.0 - cosine_squared})


RIVALS = [
    (DELAY, rows(air_0=1.0)),
    (LEAK, resembling(0.8, 1)),
    (OTHER_LEAK, resembling(0.7, 1)),
    (SAG, resembling(0.5, 2)),
    (HYSTERESIS, resembling(0.4, 3)),
    (ASYMMETRY, resembling(0.3, 4)),
    (LINE, resembling(0.25, 5)),
    (OTHER_LINE, resembling(0.22, 5)),
    (SLEW, resembling(0.001, 5)),
    (FRICTION, rows(arm_0=1.0)),
]


def rivals(shapes, missing, *effects):
    """Labels of the rivals that are fitted in the place of the first effect."""
    case, searched, begun = judgement(shapes, missing, *effects)
    model, (one, *_) = judge.needed_effects(case, searched.model)
    judge.rival_fits(case, model, one, case.unseen.remainders(model))
    return begun


@pytest.mark.parametrize(("left", "more"), [(0.0, []), (1.0, [OTHER_LINE.label, "valve_slew"])])
def test_three_rivals_of_other_families_are_fitted_and_all_of_its_own_where_more_is_left(
    left, more
):
    """Rivals promise a fifth of what the effect does, in all of their forms, and in its links.

    Else the best one of its own family is, in its best form.
    """
    found = rivals(RIVALS, rows(air_0=9.0, arm_0=9.0, air_6=left), DELAY, FRICTION)
    others = [LEAK.label, OTHER_LEAK.label, SAG.label, "valve_hysteresis"]
    assert found == [LINE.label, *more, *others]


@pytest.mark.parametrize(("left", "more"), [(0.0, []), (1.0, [OTHER_LEAK.label])])
def test_forms_of_an_effect_that_promise_little_are_fitted_where_more_is_left(left, more):
    shapes = [(LEAK, rows(air_0=1.0)), (OTHER_LEAK, resembling(0.1, 1))]
    assert rivals(shapes, rows(air_0=9.0, air_6=left), LEAK) == more


def test_all_rivals_are_fitted_of_what_promises_nothing_itself():
    shapes = [(DELAY, -rows(air_0=1.0)), (LEAK, resembling(1e-4, 1))]  # of one sign, the wrong one
    assert rivals(shapes, rows(air_0=9.0), DELAY) == [LEAK.label]


@pytest.mark.parametrize(("share", "fitted"), [(0.19, []), (0.21, ["valve_hysteresis"])])
def test_a_rival_is_joined_by_the_effect_that_promises_a_fifth_of_what_it_misses(share, fitted):
    """The best one alone, not the effect in whose place it is, and only where more is left."""
    # What the rival, whose shape is half the effect's, misses of it.
    missed = rows(air_0=0.5) - rows(air_1=0.5)

    def beside(number, share):
        return share**0.5 * missed + rows(**{f"air_{number}": 1.0 - share})

    shapes = [
        (DELAY, rows(air_0=1.0)),
        (LEAK, resembling(0.5, 1)),
        (HYSTERESIS, beside(2, share)),
        (ASYMMETRY, beside(3, share - 0.01)),
    ]
    for left in (1.0, 0.0):
        case, searched, begun = judgement(shapes, rows(air_0=9.0, air_6=left), DELAY)
        model, (one,) = judge.needed_effects(case, searched.model)
        remainders = case.unseen.remainders(model)
        rival = case.fitter.fit(None, (LEAK,), {}, ())
        assert rival.cost - model.cost == pytest.approx(0.5 * (one.rest.cost - model.cost))
        judge.pairs_of_effects(case, model, [rival], one, remainders)
        assert begun == (fitted if left else [])


def test_what_fits_better_takes_the_place_of_what_a_search_has_found_and_all_is_judged_again():
    """A leak in its place, or, where that leaves more, a leak and a hysteresis together."""
    shapes = [
        (DELAY, rows(air_0=5.0) + rows(air_1=4.0)),
        (LEAK, rows(air_0=1.0)),
        (HYSTERESIS, rows(air_1=1.0)),
    ]
    found, _ = judged(shapes, rows(air_0=9.0), DELAY)
    assert set(found) == {"air_leak"}
    assert found["air_leak"].exact
    (rival,) = (one for one in found["air_leak"].rivals if one.effect.name == "valve_delay")
    assert rival.worse.gain == pytest.approx(4.0)
    both, _ = judged(shapes, rows(air_0=4.0, air_1=9.0), DELAY)
    assert {name: one.gain for name, one in both.items()} == pytest.approx(
        {"valve_hysteresis": 9.0, "air_leak": 4.0}
    )


def test_in_a_series_rivals_are_fitted_for_an_effect_that_outweighs_all_others_alone():
    series = [DELAY, LEAK, SAG, HYSTERESIS]
    shapes = [(one, rows(**{f"air_{k}": 1.0})) for k, one in enumerate(series)]
    rival = (ASYMMETRY, resembling(0.5, 5))
    for first, fitted in ((6.1, 1), (5.9, 0)):
        missing = rows(air_0=first, air_1=1.0, air_2=1.0, air_3=1.0)
        found, begun = judged([*shapes, rival], missing, *series)
        assert begun == fitted * ["valve_asymmetry"]
        assert [one.level() for one in found.values()] == [fitted * "form", "", "", ""]
        assert found["valve_delay"].others == pytest.approx(3.0)


@pytest.mark.parametrize(("share", "found"), [(0.51, True), (0.49, False)])
def test_a_number_that_explains_more_than_half_of_an_effect_alone_is_stated_instead(share, found):
    """Of several that which has moved most, for its size; the others hold still meanwhile."""
    numbers = {"volume": (1e-5, resembling(share, 1)), "scale": (1e3, 5.0 * resembling(0.01, 2))}
    shapes = [(DELAY, rows(air_0=1.0))]
    for more, reported in ((9.1, found), (0.0, False)):  # without a remainder the delay is certain
        missing = rows(air_0=9.0, air_6=more)
        one = judged(shapes, missing, DELAY, numbers=numbers)[0]["valve_delay"].instead
        assert (one is not None) == reported
        if one is not None:
            assert (one.parameter, one.stated) == ("volume", 1e-5)
            assert one.value == pytest.approx(1e-5 * (1.0 + 3.0 * share**0.5), rel=0.05)
            assert one.share == pytest.approx(share, abs=0.01)


def test_a_promise_is_what_a_fit_keeps_where_all_is_linear():
    shapes = [
        (DELAY, rows(air_0=1.0)),
        (LEAK, resembling(0.6, 1) + rows(arm_1=0.5)),
        (ASYMMETRY, rows(air_0=1.0) - rows(air_2=1.0)),  # of either sign
        (SAG, -rows(air_1=1.0)),  # of one sign, the wrong one
        (HYSTERESIS, rows(air_0=2.0)),  # nothing of it is left beside the delay
        (SLEW, resembling(0.99, 3)),  # little is
    ]
    case, _, _ = judgement(shapes, rows(air_0=3.0, air_1=8.0, air_2=1.0, air_3=0.25))
    fit = case.fitter.fit
    model = fit(None, (DELAY,), {}, ())
    left, found = promises(model, case.tried.known)
    assert left == pytest.approx(model.rows)
    assert [one.effect for one in found] == [LEAK, ASYMMETRY, SLEW]
    for one in found:
        both = fit(None, (DELAY, one.effect), {}, ())
        assert one.gain == pytest.approx(model.cost - both.cost)
        assert left + one.rows == pytest.approx(both.rows)
        (name,) = one.start()
        assert one.start()[name] == pytest.approx(both.values[name])


def test_a_search_fits_what_promises_half_of_the_best_in_forms_that_promise_half_of_theirs():
    shapes = [
        (LEAK, rows(air_0=1.0)),
        (OTHER_LEAK, resembling(0.51, 1)),
        (SAG, resembling(0.52, 2)),
        (HYSTERESIS, resembling(0.49, 3)),
    ]
    case, searched, begun = judgement(shapes, rows(air_0=9.0))
    _, found = promises(searched.base, case.tried.known)
    fits = case.tried.best_fits(searched.base, found)
    assert begun == [LEAK.label, OTHER_LEAK.label, SAG.label]
    assert [one.effects for one in fits] == [(LEAK,), (SAG,)]


def test_what_promises_a_tenth_of_what_is_left_and_something_material_is_worth_a_fit():
    """But for what an error of a formula that was found would explain."""

    def worth(shapes, missing, *effects):
        case, searched, _ = judgement(shapes, missing, *effects)
        return [p.effect for p in case.tried.worth_fitting(searched.model, case.tried.known)[1]]

    for share, left, found in ((0.11, 9.0, 1), (0.09, 9.0, 0), (0.5, 0.042, 1), (0.5, 0.038, 0)):
        assert worth([(LEAK, resembling(share, 1))], rows(air_0=left)) == found * [LEAK]
    shapes = [(DELAY, rows(air_0=1.0)), (LEAK, rows(air_1=1.0)), (SLEW, rows(air_1=1.0))]
    missing = rows(air_0=9.0, air_1=1.0)
    assert worth(shapes[:2], missing, DELAY) == [LEAK]
    assert worth(shapes, missing, DELAY) == []
    own = [
        (DELAY, rows(air_0=1.0, arm_0=1.0)),
        (FRICTION, rows(arm_0=1.0)),
    ]  # of another size there
    assert worth(own, rows(air_0=1.0, arm_0=9.0), DELAY) == []


def test_all_forms_and_sizes_are_simulated_of_what_contends_in_its_links():
    """Of what promises a fifth of the best there, and a fifth of what is material."""
    shapes = [
        (LEAK, rows(air_0=1.0)),
        (OTHER_LEAK, rows(air_0=1.0)),
        (SAG, resembling(0.21, 1)),
        (HYSTERESIS, resembling(0.19, 2)),
        (STRIBECK, rows(arm_0=1.0)),
    ]
    for small, simulated in ((0.003, 1), (0.005, len(STRIBECK.probes))):
        case, _, _ = judgement(shapes, rows(air_0=9.0, arm_0=small))
        known = search.search(case.fitter, [one for one, _ in shapes], steps=STEPS).tried.known
        assert Counter(one.effect.label for one in known) == {
            LEAK.label: 1,
            OTHER_LEAK.label: 1,
            SAG.label: len(SAG.probes),
            "valve_hysteresis": 1,
            "stribeck_friction": simulated,
        }


@pytest.mark.parametrize(("small", "found"), [(0.021, True), (0.019, False)])
def test_a_search_takes_what_is_material_each_in_the_form_that_is_best_beside_the_others(
    small, found
):
    """The form of the leak that fits best alone stands for some of the hysteresis, too."""
    shapes = [
        (LEAK, rows(air_0=1.0)),
        (OTHER_LEAK, resembling(0.8, 1)),
        (HYSTERESIS, rows(air_1=0.5, air_2=0.5)),
        (FRICTION, rows(arm_0=1.0)),
    ]
    missing = rows(air_0=9.0, air_1=2.0, air_2=2.0, arm_0=small)
    case, _, _ = judgement(shapes, missing)
    model = search.search(case.fitter, [one for one, _ in shapes], steps=STEPS).model
    friction = {"viscous_friction"} if found else set()
    assert model.labels == {LEAK.label, "valve_hysteresis"} | friction
