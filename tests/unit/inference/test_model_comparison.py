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


@pytest.mark.parametrize("draw", [skewed, heavy])
@pytest.mark.parametrize("units", [3, 5, 12])
def test_p_values_are_uniform_where_models_predict_equally_well(units, draw):
    """On the values that so many units can give, within a 95 % band of the whole distribution."""
    rng = np.random.default_rng(units)
    values = np.empty(RUNS)
    for run in range(RUNS):
        losses = exchangeable(rng, draw, units, 2)
        result = compare_paired(losses[:, :1] - losses[:, 1:])
        values[run] = result.p_value[0]
    step = 2.0**-units
    possible = np.arange(step, 1.0 + step / 2, step)
    share = np.mean(values[:, np.newaxis] <= possible + 1e-9, axis=0)
    assert np.max(np.abs(share - possible)) < BAND
    assert values.min() >= step - 1e-12


def test_drawn_patterns_agree_with_normal_theory_for_many_units():
    rng = np.random.default_rng(2)
    differences = rng.standard_normal((40, 6)) + 0.3
    result = compare_paired(differences)
    normal = scipy.stats.ttest_1samp(differences, 0.0, alternative="greater")
    assert result.p_value == pytest.approx(normal.pvalue, abs=0.01)
    assert result.gain == pytest.approx(differences.mean(axis=0))


def test_exact_p_values_are_those_of_scipy():
    differences = np.random.default_rng(3).standard_normal((7, 4)) + 0.5
    result = compare_paired(differences)
    for column, p_value in zip(differences.T, result.p_value, strict=True):
        expected = scipy.stats.permutation_test(
            (column, np.zeros(7)),
            lambda a, b: np.sum(a - b),
            permutation_type="samples",
            alternative="greater",
            n_resamples=np.inf,
        )
        assert p_value == pytest.approx(expected.pvalue)


@pytest.mark.parametrize("units", [11, 25])
def test_neither_the_order_of_units_or_models_nor_a_unit_of_loss_matters(units):
    rng = np.random.default_rng(7)
    losses = exchangeable(rng, skewed, units, 5)
    first = compare_with_reference(losses[:, 0], losses[:, 1:])
    order, models = rng.permutation(units), rng.permutation(4)
    second = compare_with_reference(8.0 * losses[order, 0], 8.0 * losses[np.ix_(order, 1 + models)])
    assert second.p_value == pytest.approx(first.p_value[models], abs=0)
    assert second.gain == pytest.approx(8.0 * first.gain[models])


def test_few_units_have_a_smallest_p_value():
    for units in (3, 5, 13):
        certain = np.arange(1.0, units + 1.0)[:, np.newaxis]
        assert compare_paired(certain).p_value[0] == 2.0**-units
    assert compare_paired(np.ones((40, 1))).p_value[0] == 1 / (DRAWN + 1)
    assert [fewest_units(alpha) for alpha in (0.3, 0.05, 0.01, 1e-4)] == [2, 5, 7, 14]


def test_models_that_are_the_same_do_not_differ():
    result = compare_with_reference(np.ones(8), np.ones((8, 3)))
    assert result.p_value.tolist() == [1.0, 1.0, 1.0]
    assert result.gain.tolist() == [0.0, 0.0, 0.0]


def test_useless_losses_are_refused():
    with pytest.raises(InputError, match="not finite"):
        compare_paired(np.array([[1.0], [np.inf]]))
    with pytest.raises(InputError, match="not \\(n units, k\\)"):
        compare_paired(np.ones(3))
    with pytest.raises(InputError, match="not \\(n,\\), \\(n, k\\)"):
        compare_with_reference(np.ones(3), np.ones((4, 2)))
    with pytest.raises(InputError, match="alpha"):
        fewest_units(1e-5)
