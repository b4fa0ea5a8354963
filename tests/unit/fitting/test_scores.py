"""Scores against numbers computed by hand; held-out errors without leakage."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.stats

from pamsim.core.encoding import to_dict
from pamsim.core.errors import InputError
from pamsim.fitting.scores import grouped, leave_one_group_out, scores, shared_by_group


def test_scores_computed_by_hand():
    errors = scores([1.0, 2.0, 3.0, 6.0], [2.0, 2.0, 2.0, 8.0], free=1)
    # residuals 1, 0, -1, 2: SSE 6; mean 3, SST 4 + 1 + 0 + 9 = 14
    assert errors.mse == 1.5
    assert errors.rmse == pytest.approx(math.sqrt(1.5))
    assert errors.mae == 1.0
    assert errors.r2 == pytest.approx(1.0 - 6.0 / 14.0)
    assert errors.aic == pytest.approx(4.0 * math.log(1.5) + 4.0)
    assert errors.aicc == pytest.approx(errors.aic + 2.0 * 2.0 * 3.0 / 1.0)
    assert (errors.points, errors.free) == (4, 1)


def test_where_a_score_means_nothing_there_is_none():
    perfect = scores([1.0, 2.0], [1.0, 2.0], free=1)
    assert (perfect.aic, perfect.aicc, perfect.rmse) == (None, None, 0.0)
    constant = scores([2.0, 2.0, 2.0], [1.0, 2.0, 3.0], free=1)
    assert constant.r2 is None
    assert constant.aicc is None  # n = k + 2
    assert constant.aic is not None
    for measured, predicted in (([], []), ([1.0], [1.0, 2.0]), ([np.nan], [1.0])):
        with pytest.raises(InputError):
            scores(measured, predicted, 0)


def test_held_out_errors_computed_by_hand():
    y = np.array([1.0, 3.0, 10.0, 20.0])
    errors = leave_one_group_out(
        y, [0.1, 0.1, 0.2, 0.2], lambda train, test: np.full(test.size, y[train].mean()), by="x"
    )
    # group 1 predicted 15: errors 14, 12; group 2 predicted 2: errors -8, -18
    assert errors.residual.tolist() == [14.0, 12.0, -8.0, -18.0]
    assert errors.group_rmse == pytest.approx([math.sqrt(170.0), math.sqrt(194.0)])
    assert errors.rmse == pytest.approx(math.sqrt((340.0 + 388.0) / 4.0))
    assert errors.worst == pytest.approx(math.sqrt(194.0))


def test_no_group_is_both_fitted_and_predicted():
    label = np.array([3.0, 1.0, 2.0, 1.0, 3.0, 2.0])
    rows_used = []

    def fit_and_predict(train, test):
        rows_used.append(sorted([*train, *test]))
        assert set(label[train]).isdisjoint(label[test])
        return np.zeros(test.size)

    leave_one_group_out(np.zeros(6), label, fit_and_predict, by="x")
    assert rows_used == [[0, 1, 2, 3, 4, 5]] * 3


def test_a_group_that_cannot_be_predicted_is_none_and_not_zero():
    def fit_and_predict(train, test):
        if 0 in test:
            raise InputError("too few")
        return np.zeros(test.size)

    errors = leave_one_group_out([1.0, 1.0, 2.0], [0.0, 0.0, 1.0], fit_and_predict, by="x")
    assert math.isnan(errors.rmse)
    assert math.isnan(errors.worst)
    assert to_dict(errors)["group_rmse"] == [None, 2.0]
    assert to_dict(errors)["rmse"] is None


def test_a_diverging_prediction_is_an_infinite_error_and_one_group_leaves_nothing_to_fit():
    def diverge(_, test):
        return np.full(test.size, 1e200)

    assert leave_one_group_out([1.0, 1.0], [0.0, 1.0], diverge, by="x").rmse == math.inf
    with pytest.raises(InputError, match="leaves nothing to fit"):
        leave_one_group_out([1.0, 2.0], [1.0, 1.0], diverge, by="pressure")


def test_set_values_make_a_group_each_and_scattered_ones_make_bins():
    assert grouped([0.1, 0.2, 0.1]).tolist() == [0.1, 0.2, 0.1]
    scattered = np.random.default_rng(0).uniform(size=100)
    bins = grouped(scattered, most=10)
    assert np.unique(bins).size == 10
    order = np.argsort(scattered)
    assert np.all(np.diff(bins[order]) >= 0.0)  # bins of neighbours
    twenty_levels = np.repeat(np.arange(20.0), 3)
    assert np.unique(grouped(twenty_levels)).size == 20


def test_shared_residuals_are_found_by_the_f_test():
    rng = np.random.default_rng(5)
    label = np.repeat([1.0, 2.0, 3.0], 8)
    noise = rng.normal(size=24)
    expected = scipy.stats.f_oneway(noise[:8], noise[8:16], noise[16:]).pvalue
    assert shared_by_group(noise, label) == pytest.approx(expected)
    assert shared_by_group(noise + 4.0 * label, label) < 1e-4
    assert shared_by_group(noise, np.zeros(24)) == 1.0
    assert shared_by_group(label, label) == 1.0
    assert shared_by_group([1.0, 2.0], [1.0, 2.0]) == 1.0
