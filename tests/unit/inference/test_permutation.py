"""Permutation, sign-flip and bootstrap tests hold their level and agree with exact counts."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from pamsim.inference.permutation import (
    best_of_many_p_values,
    exchange_p_value,
    rms_interval95,
    sign_flip_p_value,
    sign_flips,
    upper_p_value,
)


def test_the_observed_arrangement_counts_and_rounding_does_not():
    assert upper_p_value(np.zeros(99), 1.0) == pytest.approx(0.01)
    assert upper_p_value(np.full(99, 1.0 - 1e-15), 1.0) == 1.0
    assert upper_p_value(np.full(99, -1e-14), 0.0, scale=1.0) == 1.0


def test_signs_do_not_depend_on_the_size_of_a_block():
    blocks = np.concatenate(list(sign_flips(1200, 7, np.random.default_rng(3))))
    whole = np.random.default_rng(3).choice([-1.0, 1.0], (1200, 7))
    assert np.array_equal(blocks, whole)


def test_sign_flips_approach_the_count_of_all_signs():
    values = np.random.default_rng(2).normal(0.3, 1.0, 9)
    signs = np.array(list(itertools.product([-1.0, 1.0], repeat=9)))
    exact = np.mean(signs @ values >= values.sum() - 1e-12)
    drawn = sign_flip_p_value(lambda s: s @ values, 9, 9999, np.random.default_rng(0))
    assert drawn == pytest.approx(exact, abs=0.02)


def test_exchanges_approach_the_count_of_all_orders():
    weight = np.array([0.0, 0.0, 0.0, 1.0, 2.0, 4.0])
    values = np.array([0.1, -0.4, 0.2, 0.5, 0.3, 0.9])
    orders = np.array(list(itertools.permutations(values)))
    exact = np.mean(orders @ weight >= values @ weight - 1e-12)
    drawn = exchange_p_value(lambda rows: rows @ weight, values, 4999, np.random.default_rng(0))
    assert drawn == pytest.approx(exact, abs=0.02)


def test_the_interval_of_an_error_holds_it():
    errors = np.random.default_rng(7).standard_normal(40)
    low, high = rms_interval95(errors)
    assert low < np.sqrt(np.mean(errors**2)) < high
    assert high - low == pytest.approx(4 * 0.7 / np.sqrt(40), rel=0.4)


def test_the_best_of_many_useless_extensions_is_significant_as_often_as_promised():
    """Ten useless effects: the smallest p-value among them is below 0.05 in 5 % of tables."""
    rng = np.random.default_rng(4)
    count, below, tables = 20, 0, 60
    for _ in range(tables):
        columns = rng.standard_normal((count, 11))
        noise = rng.standard_normal(count)
        base = linear_fit(columns[:, :1], noise)
        extended = [linear_fit(columns[:, [0, k]], noise) for k in range(1, 11)]
        below += min(best_of_many_p_values(*base, extended)) < 0.05
    assert below / tables < 0.13


def linear_fit(columns, noise):
    size = np.linalg.lstsq(columns, noise, rcond=None)[0]
    return noise - columns @ size, columns
