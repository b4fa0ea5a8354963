"""Paired comparisons hold their level, agree with exact counts and find planted differences."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.stats

from pamsim.core.errors import InputError
from pamsim.inference.model_comparison import (
    DRAWN,
    compare_paired,
    compare_with_reference,
    fewest_units,
    smallest_p_value,
)

RUNS = 500
BAND = np.sqrt(np.log(2 / 0.05) / (2 * RUNS))  # of a whole distribution (Massart 1990), 95 %


def skewed(rng, shape):
    return np.exp(1.5 * rng.standard_normal(shape))


def heavy(rng, shape):
    return rng.standard_t(2, shape) ** 2


def exchangeable(rng, draw, units, models):
    """Losses of models that predict equally well: what a unit shares, and what each has alone."""
    return draw(rng, (units, 1)) + draw(rng, (units, models))


@pytest.mark.parametrize("two_sided", [False, True])
@pytest.mark.parametrize("draw", [skewed, heavy])
@pytest.mark.parametrize("units", [3, 5, 12])
def test_p_values_are_uniform_where_models_predict_equally_well(units, draw, two_sided):
    """On the values that so many units can give, within a 95 % band of the whole distribution."""
    rng = np.random.default_rng(units)
    values = np.empty(RUNS)
    for run in range(RUNS):
        losses = exchangeable(rng, draw, units, 2)
        result = compare_paired(losses[:, :1] - losses[:, 1:], two_sided=two_sided)
        values[run] = result.p_value[0]
    step = smallest_p_value(units, two_sided=two_sided)
    possible = np.arange(step, 1.0 + step / 2, step)
    share = np.mean(values[:, np.newaxis] <= possible + 1e-9, axis=0)
    assert np.max(np.abs(share - possible)) < BAND
    assert values.min() >= step - 1e-12


def test_drawn_patterns_agree_with_normal_theory_for_many_units():
    rng = np.random.default_rng(2)
    differences = rng.standard_normal((40, 6)) + 0.3
    result = compare_paired(differences, two_sided=False)
    normal = scipy.stats.ttest_1samp(differences, 0.0, alternative="greater")
    assert not result.exact
    assert result.p_value == pytest.approx(normal.pvalue, abs=0.01)
    assert result.gain / result.standard_error == pytest.approx(normal.statistic)


@pytest.mark.parametrize("two_sided", [False, True])
def test_exact_p_values_are_those_of_scipy(two_sided):
    differences = np.random.default_rng(3).standard_normal((7, 4)) + 0.5
    result = compare_paired(differences, two_sided=two_sided)
    for column, p_value in zip(differences.T, result.p_value, strict=True):
        expected = scipy.stats.permutation_test(
            (column, np.zeros(7)),
            lambda a, b: np.sum(a - b),
            permutation_type="samples",
            alternative="two-sided" if two_sided else "greater",
            n_resamples=np.inf,
        )
        assert p_value == pytest.approx(expected.pvalue)
    assert result.exact


def test_any_true_null_is_rejected_as_rarely_as_promised():
    """Twenty correlated models, five of them better: of the others none in 95 % of cases."""
    rng = np.random.default_rng(4)
    runs, wrong, found, uncorrected = 300, 0, 0.0, 0
    for _ in range(runs):
        shared = rng.standard_normal((12, 4)) @ rng.standard_normal((4, 20))
        noise = shared + 0.5 * rng.standard_normal((12, 20))
        gains = np.where(np.arange(20) < 5, 4.0, 0.0)
        result = compare_with_reference(np.zeros(12), noise - gains)
        wrong += bool(np.any(result.significant(0.05)[5:]))
        uncorrected += bool(np.any(result.p_value[5:] <= 0.05))
        found += float(np.mean(result.significant(0.05)[:5]))
    assert wrong / runs < 0.05 + 2 * np.sqrt(0.05 * 0.95 / runs)
    assert uncorrected / runs > 0.2
    assert found / runs > 0.8


def test_similar_models_are_not_counted_twice():
    """Copies cost nothing; independent models cost what Bonferroni's correction does, at most."""
    rng = np.random.default_rng(5)
    one = rng.standard_normal((10, 1)) + 0.7
    alone = compare_paired(one, two_sided=False)
    copies = compare_paired(np.repeat(one, 30, axis=1), two_sided=False)
    assert copies.adjusted == pytest.approx(np.full(30, alone.p_value[0]))
    many = compare_paired(np.hstack([one, rng.standard_normal((10, 29))]), two_sided=False)
    assert alone.p_value[0] < many.adjusted[0] <= 30 * alone.p_value[0]
    assert np.all(many.adjusted >= many.p_value)
    ranked = np.argsort(many.p_value, kind="stable")
    assert np.all(np.diff(many.adjusted[ranked]) >= -0.05)


def test_later_steps_compete_with_weaker_comparisons_only():
    """A clear gain does not hide a smaller one, as it would if its flips counted throughout."""
    for seed in range(6):
        rng = np.random.default_rng(seed)
        differences = rng.standard_normal((12, 2)) * [0.01, 1.0] + [10.0, 0.5]
        both = compare_paired(differences, two_sided=False)
        alone = compare_paired(differences[:, 1:], two_sided=False)
        assert both.adjusted[1] == pytest.approx(alone.p_value[0])


@pytest.mark.parametrize("units", [11, 25])
def test_neither_the_order_of_units_or_models_nor_a_unit_of_loss_matters(units):
    rng = np.random.default_rng(7)
    losses = exchangeable(rng, skewed, units, 5)
    first = compare_with_reference(losses[:, 0], losses[:, 1:])
    order, models = rng.permutation(units), rng.permutation(4)
    second = compare_with_reference(8.0 * losses[order, 0], 8.0 * losses[np.ix_(order, 1 + models)])
    assert second.p_value == pytest.approx(first.p_value[models], abs=0)
    assert second.adjusted == pytest.approx(first.adjusted[models], abs=0)
    assert second.gain == pytest.approx(8.0 * first.gain[models])


def test_few_units_have_a_smallest_p_value():
    for units, one, two in ((3, 1 / 8, 1 / 4), (5, 1 / 32, 1 / 16), (13, 2.0**-13, 2.0**-12)):
        certain = np.arange(1.0, units + 1.0)[:, np.newaxis]
        for two_sided, smallest in ((False, one), (True, two)):
            result = compare_paired(certain, two_sided=two_sided)
            assert result.p_value[0] == result.adjusted[0] == result.smallest == smallest
    many = compare_paired(np.ones((40, 1)), two_sided=False)
    assert many.p_value[0] == many.smallest == 1 / (DRAWN + 1)
    assert (fewest_units(0.05, two_sided=False), fewest_units(0.05, two_sided=True)) == (5, 6)
    assert (fewest_units(0.01, two_sided=False), fewest_units(0.3, two_sided=True)) == (7, 3)


def test_models_that_are_the_same_do_not_differ():
    result = compare_with_reference(np.ones(8), np.ones((8, 3)))
    assert result.p_value.tolist() == result.adjusted.tolist() == [1.0, 1.0, 1.0]
    assert result.gain.tolist() == [0.0, 0.0, 0.0]


def test_useless_losses_are_refused():
    with pytest.raises(InputError, match="not finite"):
        compare_paired(np.array([[1.0], [np.inf]]), two_sided=True)
    with pytest.raises(InputError, match="not \\(n units, k\\)"):
        compare_paired(np.ones(3), two_sided=True)
    with pytest.raises(InputError, match="not \\(n,\\), \\(n, k\\)"):
        compare_with_reference(np.ones(3), np.ones((4, 2)))
    with pytest.raises(InputError, match="alpha"):
        fewest_units(1e-5, two_sided=False)
