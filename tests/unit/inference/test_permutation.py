"""Permutation and sign-flip tests hold their level."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.inference.permutation import (
    best_of_many_p_values,
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
