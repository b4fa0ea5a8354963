"""When a name is certain, when a rival takes an effect's place, and when a fit begins again."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from pamsim.diagnosis.by_link.judge import gain_of_others
from pamsim.diagnosis.by_link.judged import Judged, Rival, beside_unknown, taken_in
from pamsim.diagnosis.by_link.limits import Difference, Remainder
from pamsim.diagnosis.by_link.promise import Promise, Signature
from pamsim.diagnosis.by_link.search import Tried
from tests.unit.diagnosis.by_link.toy_chain import AIR, ARMLINK, STEPS, tried

(FRICTION,) = tried("viscous_friction")


def judged(gain, left, before, **more):
    fixed = {"effect": FRICTION, "links": frozenset([ARMLINK]), "p_value": 0.001, "rivals": ()}
    found = {"exact": False, "named": False, "by_link": {ARMLINK: gain}, **more}
    return Judged(gain=gain, left=left, before=before, **fixed, **found)


def test_a_name_is_certain_as_deep_as_what_is_left_allows():
    for gain, left, before, more, level in (
        (9.0, 1.0, 10.0, {}, "family"),  # nine tenths of what it takes away and what is left
        (8.9, 1.0, 9.9, {}, ""),
        # Beside a larger effect, together with which it explains enough.
        (0.3, 0.1, 2.0, {}, "family"),
        (0.3, 0.1, 0.8, {}, ""),
        (0.15, 0.1, 2.0, {}, ""),  # less than twice of what is left
        # As small as the error of another one's formula.
        (0.3, 0.0, 9.3, {"error": 0.2}, "family"),
        (0.3, 0.0, 9.3, {"error": 0.9}, ""),
        # Next to nothing is left, but its formula is not exact.
        (9.0, 0.01, 9.1, {"named": True}, "name"),
        # In a series only what outweighs all others.
        (0.5, 0.0, 1.0, {"others": 0.2}, "family"),
        (0.3, 0.0, 1.0, {"others": 0.2}, ""),
        # Beside what is left, though that be too little to count.
        (0.09, 0.0, 0.1, {"uncounted": 0.04}, "family"),
        (0.07, 0.0, 0.1, {"uncounted": 0.04}, ""),
        # It takes away less than is left, whatever formula may take that.
        (0.5, 0.0, 0.6, {"missed": 0.4}, "family"),
        (0.5, 0.0, 0.6, {"missed": 0.6}, ""),
        # At the end of a range it stands for another one.
        (9.0, 0.0, 9.0, {"named": True, "exact": True}, "form"),
        (9.0, 0.0, 9.0, {"named": True, "exact": True, "at_end": True}, ""),
        # In links that miss no more than noise.
        (0.1, 0.0, -0.01, {"named": True, "exact": True}, ""),
        # Beside a larger effect of its family.
        (9.0, 0.0, 9.0, {"named": True, "exact": True, "second": True}, "family"),
    ):
        found = judged(gain, left, before, **more).level()
        assert found == level, (gain, left, before, more)


def test_nothing_is_certain_beside_a_larger_effect_whose_place_is_not():
    unknown, small = judged(2.0, 0.9, 3.0), judged(1.4, 0.1, 3.0)
    assert [one.level() for one in beside_unknown([small])] == ["family"]
    assert [one.level() for one in beside_unknown([small, unknown])] == ["", ""]
    large = judged(9.0, 0.9, 9.9)
    assert [one.level() for one in beside_unknown([small, large])] == ["family", "family"]
    exact = replace(unknown, exact=True)
    assert [one.level() for one in beside_unknown([small, exact])] == ["", "family"]
    alone = judged(0.05, 0.0, 0.05, named=True)  # the only one of its family, however small
    assert [one.level() for one in beside_unknown([alone])] == ["name"]


def test_the_error_of_a_formula_is_no_larger_in_a_link_than_what_it_takes_away_there():
    """A backlash moves the pressures a little: it is not why a reservoir is missing there."""
    wide = frozenset([AIR, ARMLINK])
    unknown = replace(judged(4.0, 2.0, 9.0, by_link={AIR: 0.4, ARMLINK: 7.6}), links=wide)
    there = {"by_link": {AIR: 0.9}}
    small = replace(judged(0.9, 0.0, 0.9, **there), links=frozenset([AIR]))
    assert [one.level() for one in beside_unknown([small, unknown])] == ["", "family"]
    near = replace(unknown, by_link={AIR: 1.0, ARMLINK: 7.0})
    assert [one.level() for one in beside_unknown([small, near])] == ["", ""]
    # The mean over the links of an effect, as its gain is.
    both = replace(small, links=wide, by_link={AIR: 1.8})
    assert taken_in(both.links, {AIR: 1.0}) == 0.5
    assert taken_in(both.links, {ARMLINK: -1.0}) == 0.0


def test_of_a_family_at_one_place_the_name_of_one_that_outweighs_the_others_is_certain():
    exact = {"named": True, "exact": True}
    small, large = judged(1.0, 0.0, 9.0, **exact), judged(8.0, 0.0, 9.0, **exact)
    first, second = beside_unknown([small, large])
    assert (first.gain, first.level(), second.level()) == (8.0, "form", "family")
    near = beside_unknown([judged(4.0, 0.0, 9.0, **exact), judged(5.0, 0.0, 9.0, **exact)])
    assert [one.level() for one in near] == ["family", "family"]
    elbow = replace(FRICTION, effect=replace(FRICTION.effect, place="elbow"))
    there = replace(small, effect=elbow, links=frozenset([AIR]))
    assert [one.level() for one in beside_unknown([there, large])] == ["form", "form"]


def test_inexact_errors_of_two_sensors_may_be_one_cause_before_both():
    names = ("angle_lag", "pressure_lag", "angle_scale")
    angle, pressure, scale = (tried(name)[0] for name in names)

    def levels(*effects, exact):
        each = [
            replace(judged(9.0, 0.0, 9.0), effect=effect, exact=exact and i == 0)
            for i, effect in enumerate(effects)
        ]
        return [(one.level(), one.upstream) for one in beside_unknown(each)]

    assert levels(angle, pressure, exact=False) == 2 * [("", "line_lag")]
    assert levels(angle, pressure, exact=True) == 2 * [("", "line_lag")]  # one of the two is not
    assert levels(scale, pressure, exact=False) == 2 * [("family", "")]
    lag = replace(judged(9.0, 0.0, 9.0), effect=angle, exact=True)
    both = beside_unknown([lag, replace(lag, effect=pressure)])
    assert [one.upstream for one in both] == ["", ""]


def test_without_repeats_what_is_left_beyond_the_noise_is_not_counted_and_not_excluded():
    left = Remainder(excess=0.3, p_value=1.0, known=False)
    assert (left.certain, left.uncounted) == (0.0, 0.3)
    assert Remainder(excess=0.3, p_value=0.01).uncounted == 0.0
    assert Remainder(excess=0.3, p_value=0.2).uncounted == 0.3
    assert Remainder(excess=-0.1, p_value=0.2).uncounted == 0.0


def test_effects_are_a_series_only_where_a_link_holds_four():
    def needed(gain, *links):
        return SimpleNamespace(found=SimpleNamespace(gain=gain), links=frozenset(links))

    one, *others = needed(9.0, AIR, ARMLINK), needed(1.0, ARMLINK), needed(2.0, ARMLINK)
    assert gain_of_others(one, [one, *others, needed(4.0, AIR)]) == 0.0
    assert gain_of_others(one, [one, *others, needed(4.0, ARMLINK), needed(8.0, AIR)]) == 7.0


def test_a_rival_that_predicts_worse_takes_no_place_however_well_it_fits():
    model = SimpleNamespace(criterion=10.0)
    for excess, preferred in ((-0.1, True), (0.6, False)):
        worse = Difference(gain=excess, p_value=0.5)
        rival = Rival(effect=FRICTION, model=model, worse=worse)
        assert rival.preferred_to(SimpleNamespace(criterion=1000.0)) == preferred


def test_a_fit_that_ends_worse_than_without_the_effect_begins_again_nearer():
    begun = []

    class Fitter:
        simulator = SimpleNamespace(links=(ARMLINK,))

        def fit(self, model, effects, start, links):
            (size,) = start.values()
            begun.append(size)
            cost = 200.0 if len(begun) == 1 else 50.0
            return SimpleNamespace(cost=cost, criterion=cost, effects=effects)

        def by_link(self, squares):
            return np.array([squares.sum()])

        def shown_in(self, squares):
            return frozenset([ARMLINK])

    rows, (probe, *_) = np.ones(4), FRICTION.probes
    signature = Signature(effect=FRICTION, probe=probe, rows=rows)
    promise = Promise(signature=signature, gain=4.0, factor=2.0, rows=rows)
    model = SimpleNamespace(cost=100.0, effects=())
    (fit,) = Tried(Fitter(), STEPS, [signature]).best_fits(model, [promise])
    (neutral,) = FRICTION.neutral.values()
    assert fit.cost == 50.0
    assert begun[1] - neutral == pytest.approx(0.1 * (begun[0] - neutral))
