"""Comparisons of paired units hold their level, and find planted differences."""

import numpy as np
import pytest
import scipy.stats

from pamsim.core.errors import InputError
from pamsim.inference.model_comparison import DRAWN, compare_paired, fewest_units, upper_p_value


@pytest.mark.parametrize("seed", range(3))
def test_drawn_patterns_agree_with_normal_theory_for_many_units(seed):
    differences = np.random.default_rng(seed).standard_normal(40) + 0.3
    gain, p_value = compare_paired(differences)
    normal = scipy.stats.ttest_1samp(differences, 0.0, alternative="greater")
    assert p_value == pytest.approx(normal.pvalue, abs=0.01)
    assert gain == pytest.approx(differences.mean())


@pytest.mark.parametrize("seed", range(3))
def test_exact_p_values_are_those_of_scipy(seed):
    differences = np.random.default_rng(seed).standard_normal(7) + 0.5
    expected = scipy.stats.permutation_test(
        (differences, np.zeros(7)),
        lambda a, b: np.sum(a - b),
        permutation_type="samples",
        alternative="greater",
        n_resamples=np.inf,
    )
    assert compare_paired(differences)[1] == pytest.approx(expected.pvalue)


@pytest.mark.parametrize("units", [11, 25])
def test_neither_the_order_of_units_nor_a_unit_of_loss_matters(units):
    rng = np.random.default_rng(7)
    differences = np.subtract(*np.exp(rng.standard_normal((2, units))))
    gain, p_value = compare_paired(differences)
    again = compare_paired(8.0 * rng.permutation(differences))
    assert again == (pytest.approx(8.0 * gain), pytest.approx(p_value, abs=0))


def test_few_units_have_a_smallest_p_value():
    for units in (3, 5, 13):
        assert compare_paired(np.arange(1.0, units + 1.0))[1] == 2.0**-units
    assert compare_paired(np.ones(40))[1] == 1 / (DRAWN + 1)
    assert [fewest_units(alpha) for alpha in (0.3, 0.05, 0.01, 1e-4)] == [2, 5, 7, 14]


def test_models_that_are_the_same_do_not_differ_and_useless_losses_are_refused():
    assert compare_paired(np.zeros(8)) == (0.0, 1.0)
    with pytest.raises(InputError, match="not finite"):
        compare_paired(np.array([1.0, np.inf]))
    for differences in (np.ones((3, 1)), np.empty(0)):
        with pytest.raises(InputError, match="not \\(n units,\\)"):
            compare_paired(differences)
    with pytest.raises(InputError, match="alpha"):
        fewest_units(1e-5)


def test_the_observed_arrangement_counts_and_rounding_does_not():
    assert upper_p_value(np.zeros(99), 1.0) == pytest.approx(0.01)
    assert upper_p_value(np.full(99, 1.0 - 1e-15), 1.0) == 1.0
    assert upper_p_value(np.full(99, -1e-14), 0.0, scale=1.0) == 1.0
