"""Effects hidden in a table are named, nothing is named for nothing, and order means nothing."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.diagnosis.method.evidence import compare_rows
from pamsim.diagnosis.method.rivals import shared_names
from pamsim.diagnosis.method.row_fit import RowSimulator, fit_rows
from pamsim.diagnosis.method.row_leave_one_out import left_out, linearised_left_out
from pamsim.diagnosis.method.verdict import Verdict
from pamsim.diagnosis.method.where import row_maps
from tests.unit.diagnosis.toy_rows import (
    LIBRARY,
    LOCK,
    NOISE,
    NUISANCE,
    SOFTEN,
    Table,
    diagnosed,
    effect,
    measured,
)

TABLE = Table()


@pytest.mark.parametrize(
    ("hidden", "quantity"),
    [({"lock": 1.5}, "step"), ({"soften": 0.1}, "low"), ({"tilt": 1.5}, None)],
    ids=["lock", "soften", "tilt"],
)
def test_a_hidden_effect_is_named_sized_and_shown_where_it_acts(hidden, quantity):
    found = diagnosed(TABLE, measured(TABLE, hidden))
    ((name, truth),) = hidden.items()
    assert found.verdict is Verdict.NAMED
    assert found.best.names == (name,)
    low, high = found.best.intervals[name]
    assert low < truth < high
    assert found.best.left_out.rms < 1.5 * NOISE < found.base.left_out.rms
    if quantity:
        surest = found.before[0]
        assert surest.quantity == quantity
        assert surest.p_value < 0.01


def test_two_hidden_effects_are_both_named():
    found = diagnosed(TABLE, measured(TABLE, {"lock": 1.5, "soften": 0.1}))
    assert found.verdict is Verdict.NAMED
    assert sorted(found.best.names) == ["lock", "soften"]


@pytest.mark.parametrize("hidden", [{}, {"lock": 1.5}, {"lock": 1.5, "soften": 0.1}])
def test_the_steps_announced_are_never_too_few_and_the_last_is_the_last(hidden):
    steps = []
    diagnosed(TABLE, measured(TABLE, hidden), progress=lambda *step: steps.append(step))
    totals = [total for _, total, _ in steps]
    assert totals == sorted(totals, reverse=True)
    assert steps[-1][0] + 1 == totals[-1]


def test_nothing_is_named_for_noise_alone():
    verdicts = [diagnosed(TABLE, measured(TABLE, {}, seed=s)).verdict for s in range(6)]
    assert sum(v is not Verdict.NO_GAP for v in verdicts) <= 1


def test_rows_that_scatter_more_at_high_pressure_name_nothing():
    """Noise that is not equal everywhere must not be taken for an effect there."""
    named = 0
    for seed in range(5):
        scatter = np.random.default_rng([seed, 9]).standard_normal(TABLE.step.size)
        angle = TABLE.angle({}) + NOISE * scatter * np.where(TABLE.low > 2.0, 6.0, 1.0)
        named += diagnosed(TABLE, angle).best is not None
    assert named <= 1


def test_a_truth_outside_the_library_is_not_named_something_else():
    found = diagnosed(TABLE, measured(TABLE, {"wave": 0.06}))
    assert found.verdict in (Verdict.UNEXPLAINED, Verdict.NO_GAP)
    assert found.best is None
    without = [e for e in LIBRARY if e is not LOCK]
    found = diagnosed(TABLE, measured(TABLE, {"lock": 1.5}), without)
    assert found.verdict in (Verdict.UNEXPLAINED, Verdict.NAMED_WITH_REMAINDER)


@pytest.mark.parametrize("family", ["soften", "other"])
def test_an_effect_with_the_same_signature_leaves_it_open(family):
    """As for recordings, a rival of the same family counts too."""
    copy = effect("copy", 0.03, -0.3, 0.3, family=family)
    found = diagnosed(TABLE, measured(TABLE, {"soften": 0.1}), (*LIBRARY, copy))
    assert found.verdict is Verdict.AMBIGUOUS
    assert len(found.tied) == 1
    assert {found.best.names[0], found.tied[0].names[0]} == {"soften", "copy"}


def test_of_two_effects_the_one_without_a_rival_is_in_all_alternatives():
    copy = effect("copy", 0.03, -0.3, 0.3, family="other")
    angle = measured(TABLE, {"soften": 0.1, "lock": 1.5})
    found = diagnosed(TABLE, angle, (*LIBRARY, copy))
    assert found.verdict is Verdict.AMBIGUOUS
    assert shared_names([found.best.names, *(m.names for m in found.tied)]) == ("lock",)


def test_the_order_of_the_rows_changes_nothing():
    angle = measured(TABLE, {"lock": 1.5, "soften": 0.1})
    order = np.random.default_rng(1).permutation(TABLE.step.size)
    one, other = diagnosed(TABLE, angle), diagnosed(TABLE.taken(order), angle[order])
    assert one.verdict is other.verdict
    assert one.best.names == other.best.names
    assert [m.p_value for m in one.before] == [m.p_value for m in other.before]
    for a, b in zip(one.attempts, other.attempts, strict=True):
        assert (a.name, a.p_value, a.p_value_unseen) == (b.name, b.p_value, b.p_value_unseen)
        assert a.left_out_rms == pytest.approx(b.left_out_rms, rel=1e-6)
    assert one.best.left_out.residual[order] == pytest.approx(
        other.best.left_out.residual, abs=1e-7
    )


def test_few_rows_carry_no_name():
    few = TABLE.taken(np.arange(9))
    found = diagnosed(few, measured(few, {"lock": 3.0}, noise=1e-3))
    assert found.verdict in (Verdict.NOT_IDENTIFIABLE, Verdict.NO_GAP)


def test_predictions_that_need_an_anchor_end_where_they_are_exact():
    angle = measured(TABLE, {"lock": 1.5})
    off = {"value": np.zeros(TABLE.step.size)}

    def exact(values):
        return TABLE.angle(values) + 0.02 * np.tanh(TABLE.step * (1.0 + values.get("lock", 0.0)))

    def anchor(values):
        off["value"] = exact(values) - TABLE.angle(values)

    target = angle + 0.02 * np.tanh(TABLE.step * 2.5)
    simulator = RowSimulator(
        predict=lambda sets: [TABLE.angle(v) + off["value"] - target for v in sets], anchor=anchor
    )
    found = diagnosed(TABLE, target, simulator=simulator)
    assert found.best.names == ("lock",)
    assert found.best.fit.residual == pytest.approx(exact(found.best.fit.values) - target, abs=1e-4)


def simulator_of(angle):
    return RowSimulator(predict=lambda sets: [TABLE.angle(v) - angle for v in sets])


def test_rows_left_out_are_those_of_full_refits():
    angle = measured(TABLE, {"lock": 1.0, "soften": 0.1}, noise=0.02)
    parameters = (*NUISANCE, *LOCK.parameters, *SOFTEN.parameters)
    start = {"gain": 0.12, "lock": 0.5, "soften": 0.03}
    fit = fit_rows(simulator_of(angle), parameters, [start])
    left = left_out(simulator_of(angle), fit)
    for i in range(TABLE.step.size):
        keep = np.arange(TABLE.step.size) != i
        part = RowSimulator(
            predict=lambda sets, keep=keep: [(TABLE.angle(v) - angle)[keep] for v in sets]
        )
        alone = fit_rows(part, parameters, [fit.values])
        error = (TABLE.angle(alone.values) - angle)[i]
        assert left.residual[i] == pytest.approx(error, abs=2e-4)
    assert linearised_left_out(fit) == pytest.approx(left.residual, abs=0.1 * left.rms)


def test_a_model_without_free_parameters_leaves_nothing_to_refit():
    found = diagnosed(TABLE, measured(TABLE, {"lock": 1.5}), nuisance=())
    assert found.base.fit.parameters == ()
    assert np.array_equal(found.base.left_out.residual, found.base.fit.residual)
    assert found.best.names == ("lock",)


def test_a_base_model_that_predicts_nothing_is_refused():
    with pytest.raises(InputError, match="no angle at rest"):
        diagnosed(
            TABLE, TABLE.angle({}), simulator=RowSimulator(predict=lambda sets: [None] * len(sets))
        )


def test_sign_flips_count_what_all_signs_would():
    before, after = np.random.default_rng(2).normal(0.0, [[1.0], [0.7]], (2, 9))
    difference = before**2 - after**2
    signs = np.array(list(itertools.product([-1.0, 1.0], repeat=9)))
    exact = np.mean(signs @ difference >= difference.sum() - 1e-12)
    found = compare_rows(before, after)
    assert found.p_value == pytest.approx(exact, abs=0.02)
    assert found.gain == pytest.approx(difference.mean())
    assert compare_rows(before, before).p_value == 1.0


def test_maps_keep_equal_values_together_and_find_the_bin_that_is_off():
    rng = np.random.default_rng(5)
    pressure = np.repeat([0.0, 1.0, 2.0, 3.0], [11, 4, 4, 4])
    names = tuple(map(str, range(pressure.size)))
    misfit = 0.3 * rng.standard_normal(pressure.size) + np.where(pressure == 3.0, 1.0, 0.0)
    found, _ = row_maps(
        misfit, {"pressure": pressure, "other": rng.permutation(pressure)}, names, channel="angle"
    )
    assert found.quantity == "pressure"
    assert found.region == (3.0, 3.0)
    assert found.rows[found.worst] == names[19:]
    assert found.p_value < 0.01
    flat = row_maps(misfit, {"same": np.ones(pressure.size)}, names, channel="angle")
    assert flat == ()


def test_of_two_bins_the_one_with_the_larger_mean_is_worse_whatever_the_rounding():
    """Two bins differ equally from the common mean."""
    direction = np.repeat([-1.0, 1.0], [10, 11])
    names = tuple(map(str, range(direction.size)))
    for seed in range(20):
        misfit = np.random.default_rng(seed).normal(0.3, 1.0, direction.size)
        (found,) = row_maps(misfit, {"direction": direction}, names, channel="angle")
        assert found.worst == np.argmax(np.abs(found.mean))


def test_maps_of_noise_are_uniform():
    rng = np.random.default_rng(6)
    values = rng.uniform(size=20)
    names = tuple(map(str, range(20)))
    chances = [
        row_maps(rng.standard_normal(20), {"x": values}, names, channel="angle", seed=s)[0].p_value
        for s in range(60)
    ]
    assert 0.3 < np.mean(chances) < 0.7


def test_an_effect_is_not_claimed_on_one_test_alone():
    found = diagnosed(TABLE, measured(TABLE, {"lock": 1.5})).best
    assert found.accepted
    assert not dataclasses.replace(found, p_value=0.06).accepted
    assert not dataclasses.replace(
        found, improvement=dataclasses.replace(found.improvement, p_value=0.06)
    ).accepted
