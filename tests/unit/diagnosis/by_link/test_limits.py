"""The level of the tests and the materiality decide what is claimed and reported, as asked for."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from pamsim.core.errors import InputError
from pamsim.diagnosis.by_link.held_out import HeldOut
from pamsim.diagnosis.by_link.limits import (
    ALPHA,
    LEAST,
    MATERIAL,
    USUAL,
    Difference,
    Limits,
    Remainder,
)
from pamsim.diagnosis.by_link.search import search
from pamsim.diagnosis.options import AS_USUAL, Options
from tests.unit.diagnosis.by_link.test_judge import judged
from tests.unit.diagnosis.by_link.test_link_diagnosis import DELAY, EFFECTS, STIFFNESS
from tests.unit.diagnosis.by_link.toy_chain import STEPS, ToyChain, diagnosed, fitter_of
from tests.unit.diagnosis.by_link.toy_table import Table, measured
from tests.unit.diagnosis.by_link.toy_table import diagnosed as diagnosed_table

SMALL = {"passive.stiffness": 2.0 * STIFFNESS, "valve.delay": DELAY}
"""Of two links, the second the smaller by far."""


def test_what_is_not_material_is_not_reported():
    chain = ToyChain(EFFECTS, SMALL)
    _, _, found = diagnosed(chain, EFFECTS)
    small, large = found["valve_delay"].gain, found["passive_stiffness"].gain
    assert large > 10.0 * small
    _, _, left = diagnosed(chain, EFFECTS, Limits(material=3.0 * small))
    assert set(left) == {"passive_stiffness"}
    _, _, both = diagnosed(chain, EFFECTS, Limits(material=small / 3.0))
    assert set(both) == set(found)


def test_nothing_is_claimed_by_fewer_trials_than_the_level_needs():
    """Flips of the signs of twelve held-out trials reach 1 in 4096."""
    chain = ToyChain(EFFECTS, SMALL)
    for alpha, there in ((0.001, True), (1.0 / 5000.0, False)):
        limits = replace(USUAL)
        object.__setattr__(limits, "alpha", alpha)  # below what may be asked for
        _, _, found = diagnosed(chain, EFFECTS, limits)
        assert bool(found) is there


def test_differences_remainders_and_levels_are_certain_from_the_level_on():
    strict = Limits(alpha=0.01)
    for p_value, usual, certain in ((0.005, True, True), (0.03, True, False), (0.2, False, False)):
        for limits, expected in ((USUAL, usual), (strict, certain)):
            assert Difference(gain=1.0, p_value=p_value, limits=limits).certain is expected
            left = Remainder(excess=1.0, p_value=p_value, limits=limits)
            assert left.counts is expected
            one = judged(9.0, 0.0, 9.0, named=True, exact=True, limits=limits)
            assert bool(replace(one, p_value=p_value).level()) is expected


def test_what_is_judged_has_the_limits_that_were_asked_for():
    limits = Limits(alpha=0.02, material=0.03, least=0.07)
    tied = {"chamber.leak_conductance": "valve.delay"}
    chain = ToyChain(EFFECTS, {"valve.delay": DELAY}, same=tied)
    fitter, model, found = diagnosed(chain, EFFECTS, limits)
    assert {one.limits for one in found.values()} == {limits}
    assert {r.worse.limits for one in found.values() for r in one.rivals} == {limits}
    assert {one.limits for one in HeldOut(fitter).remainders(model).values()} == {limits}
    table = Table()
    rows = diagnosed_table(table, measured(table, {"lock": 1.5}), alpha=0.02)
    assert rows.limits.alpha == 0.02
    assert {one.limits for one in rows.effects} == {rows.limits}
    assert {one.limits for one in rows.remainders.values()} == {rows.limits}


def test_rows_at_rest_search_for_what_noise_does_that_seldom():
    table = Table(24)
    angle = measured(table, {"lock": 1.5})
    for alpha in (0.05, 0.01):
        found = diagnosed_table(table, angle, alpha=alpha)
        assert found.limits.material == pytest.approx(chi2.isf(alpha, 1) / 24)
        assert found.limits.least == LEAST
    with pytest.raises(InputError, match=r"6 rows: 7 or more are needed, since fewer .* at 1 %"):
        diagnosed_table(Table(6), np.zeros(6), alpha=0.01)


def test_by_default_the_limits_are_the_stated_ones():
    assert AS_USUAL.limits == USUAL == Limits(alpha=ALPHA, material=MATERIAL, least=LEAST)
    assert Options(material=0.2).limits.least == 0.2  # a remainder below it is not material either
    chain = ToyChain(EFFECTS, SMALL)
    one, other = (search(fitter_of(chain, own), EFFECTS, steps=STEPS) for own in (USUAL, Limits()))
    assert one.model.values == other.model.values


@pytest.mark.parametrize(
    ("chosen", "message"),
    [
        ({"alpha": 0.0}, "`alpha` is 0; it must be from 0.001 to 0.5"),
        ({"alpha": 5.0}, "`alpha` is 5; it must be from 0.001 to 0.5"),
        ({"alpha": float("nan")}, "`alpha` is nan; it must be from 0.001 to 0.5"),
        ({"material": 0.0}, "`material` is 0; it must be above 0"),
        ({"material": -1.0}, "`material` is -1; it must be above 0"),
        ({"material": float("inf")}, "`material` is inf; it must be above 0"),
    ],
)
def test_limits_that_nothing_can_be_judged_by_are_refused(chosen, message):
    with pytest.raises(InputError, match=message):
        Options(**chosen)
