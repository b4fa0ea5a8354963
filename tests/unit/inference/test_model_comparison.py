"""Comparisons of paired units hold their level, and find planted differences."""

import numpy as np
import pytest
import scipy.stats

from pamsim.core.errors import InputError
from pamsim.inference.model_comparison import (
    DRAWN,
    compare_paired,
    compare_with_reference,
    fewest_units,
    upper_p_value,
)
from pamsim.inference.near_units import missed_together, nearest_units
from pamsim.inference.permutation import best_of_many_p_values


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


def test_neither_the_order_of_units_or_models_nor_a_unit_of_loss_matters():
    for units in (11, 25):
        rng = np.random.default_rng(7)
        losses = np.exp(rng.standard_normal((units, 5)))
        first = compare_with_reference(losses[:, 0], losses[:, 1:])
        order, models = rng.permutation(units), rng.permutation(4)
        others = 8.0 * losses[np.ix_(order, 1 + models)]
        second = compare_with_reference(8.0 * losses[order, 0], others)
        assert second.p_value == pytest.approx(first.p_value[models], abs=0)
        assert second.gain == pytest.approx(8.0 * first.gain[models])


def test_few_units_have_a_smallest_p_value():
    for units in (3, 5, 13):
        certain = np.arange(1.0, units + 1.0)[:, np.newaxis]
        assert compare_paired(certain).p_value[0] == 2.0**-units
    assert compare_paired(np.ones((40, 1))).p_value[0] == 1 / (DRAWN + 1)
    assert [fewest_units(alpha) for alpha in (0.3, 0.05, 0.01, 1e-4)] == [2, 5, 7, 14]


def test_models_that_are_the_same_do_not_differ_and_useless_losses_are_refused():
    result = compare_with_reference(np.ones(8), np.ones((8, 3)))
    assert result.p_value.tolist() == [1.0, 1.0, 1.0]
    assert result.gain.tolist() == [0.0, 0.0, 0.0]
    with pytest.raises(InputError, match="not finite"):
        compare_paired(np.array([[1.0], [np.inf]]))
    with pytest.raises(InputError, match="not \\(n units, k\\)"):
        compare_paired(np.ones(3))
    with pytest.raises(InputError, match="not \\(n,\\), \\(n, k\\)"):
        compare_with_reference(np.ones(3), np.ones((4, 2)))
    with pytest.raises(InputError, match="alpha"):
        fewest_units(1e-5)


def table(rng, rows=14):
    """Inputs in a plane, and columns that a model has fitted."""
    inputs = rng.uniform(size=(rows, 2))
    return inputs, np.stack([np.ones(rows), inputs[:, 0], inputs[:, 1] ** 2], axis=1)


def left(jacobian, values):
    basis, _ = np.linalg.qr(jacobian)
    return values - basis @ (basis.T @ values)


def test_what_near_units_miss_together_is_found_in_noise_as_often_as_the_level_says():
    found = []
    for seed in range(200):
        rng = np.random.default_rng([seed, 1])
        inputs, jacobian = table(rng)
        spread = np.where(inputs[:, 0] > 0.5, 4.0, 1.0)
        rows = left(jacobian, spread * rng.standard_normal(len(inputs)))
        found.append(missed_together(rows, jacobian, nearest_units(inputs), seed=seed))
    p_values = np.array([p_value for _, p_value in found])
    # Of 200 at a level of 5 %, more than 18 are a chance of 1 in 100.
    assert np.sum(p_values <= 0.05) <= 18
    assert abs(np.mean([excess for excess, _ in found])) < 0.2 * 4.0**2


def test_what_changes_slowly_along_an_input_is_found_and_sized():
    rng = np.random.default_rng(0)
    along = np.linspace(0.0, 1.0, 24)
    missed = 2.0 * np.sin(2.0 * np.pi * along)
    near = nearest_units(along[:, np.newaxis])
    excess, p_value = missed_together(missed + rng.standard_normal(24), np.empty((24, 0)), near)
    assert p_value < 0.01
    assert excess == pytest.approx(np.mean(missed**2), rel=0.5)


def test_neighbours_that_are_equally_near_share_a_weight_and_each_input_counts_by_its_span():
    near = nearest_units(np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.0, 3e6]]))
    assert near[1].tolist() == [0.5, 0.0, 0.5, 0.0]
    assert near[0].tolist() == [0.0, 1.0, 0.0, 0.0]
    assert near[3].tolist() == [1.0, 0.0, 0.0, 0.0]
    apart = nearest_units(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 2e5], [2.0, 1e6]]))
    assert apart[0].tolist() == [0.0, 0.0, 1.0, 0.0]
    assert nearest_units(np.ones((3, 1))).tolist() == [[0, 0.5, 0.5], [0.5, 0, 0.5], [0.5, 0.5, 0]]


def test_the_order_of_units_changes_nothing():
    rng = np.random.default_rng(3)
    inputs, jacobian = table(rng)
    rows = left(jacobian, rng.standard_normal(len(inputs)))
    order = rng.permutation(len(inputs))
    one = missed_together(rows, jacobian, nearest_units(inputs))
    other = missed_together(rows[order], jacobian[order], nearest_units(inputs[order]))
    assert one == pytest.approx(other)


def test_the_observed_arrangement_counts_and_rounding_does_not():
    assert upper_p_value(np.zeros(99), 1.0) == pytest.approx(0.01)
    assert upper_p_value(np.full(99, 1.0 - 1e-15), 1.0) == 1.0
    assert upper_p_value(np.full(99, -1e-14), 0.0, scale=1.0) == 1.0


def linear_fit(columns, noise):
    size = np.linalg.lstsq(columns, noise, rcond=None)[0]
    return noise - columns @ size, columns


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
