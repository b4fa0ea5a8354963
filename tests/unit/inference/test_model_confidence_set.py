"""The model confidence set holds the best model at its level and loses those that are worse."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.inference.model_comparison import compare_paired
from pamsim.inference.model_confidence_set import model_confidence_set


def losses_of(rng, means, units, *, spread=1.0):
    """Skewed, with what a unit has in common, and correlated between models."""
    unit = np.exp(rng.standard_normal((units, 1)))
    shared = rng.standard_normal((units, 3)) @ rng.standard_normal((3, len(means)))
    return unit * (5.0 + shared) + spread * rng.standard_normal((units, len(means))) + means


@pytest.mark.parametrize("units", [3, 5, 12])
@pytest.mark.parametrize("best", [1, 3])
def test_the_best_models_are_in_the_set_at_its_level(units, best):
    rng = np.random.default_rng(units)
    means = np.where(np.arange(6) < best, 0.0, [0.0, 0.5, 1.0, 2.0, 4.0, 8.0])
    runs, level = 250, 0.2
    kept = [
        np.all(model_confidence_set(losses_of(rng, means, units), level).kept[:best])
        for _ in range(runs)
    ]
    assert np.mean(kept) > 1.0 - level - 2 * np.sqrt(level * (1.0 - level) / runs)


def test_models_that_are_worse_leave_the_set():
    rng = np.random.default_rng(1)
    kept = np.mean(
        [
            model_confidence_set(losses_of(rng, [0.0, 0.0, 8.0, 20.0], 12), 0.05).kept
            for _ in range(100)
        ],
        axis=0,
    )
    assert np.all(kept[:2] > 0.9)
    assert kept[2] < 0.3
    assert kept[3] < 0.05


@pytest.mark.parametrize("units", [3, 4, 5])
def test_up_to_five_units_take_no_model_out_at_5_per_cent(units):
    losses = np.arange(units)[:, np.newaxis] + np.array([0.0, 100.0])
    found = model_confidence_set(losses, 0.05)
    assert found.kept.tolist() == [True, True]
    assert not found.decidable
    assert found.p_values.tolist() == [1.0, 2.0 ** (1 - units)]
    six = model_confidence_set(np.arange(6)[:, np.newaxis] + np.array([0.0, 100.0]), 0.05)
    assert six.kept.tolist() == [True, False]


def test_two_models_are_compared_as_a_pair_is():
    losses = np.random.default_rng(2).gamma(1.0, size=(11, 2)) + np.array([0.0, 0.5])
    pair = compare_paired(losses[:, :1] - losses[:, 1:], two_sided=True)
    assert min(model_confidence_set(losses, 0.05).p_values) == pytest.approx(pair.p_value[0])


def test_p_values_are_those_of_sets_taken_one_by_one():
    """The nested sets, each tested again with all of its pairs."""
    losses = losses_of(np.random.default_rng(3), [0.0, 0.5, 1.0, 3.0, 3.0], 9)
    found = model_confidence_set(losses, 0.05)
    left, expected, so_far = list(range(5)), np.ones(5), 0.0
    while len(left) > 1:
        pairs = [(a, b) for a in left for b in left if a != b]
        differences = np.stack([losses[:, a] - losses[:, b] for a, b in pairs], axis=1)
        so_far = max(so_far, float(compare_paired(differences, two_sided=False).adjusted.min()))
        ratio = differences.sum(axis=0) / np.linalg.norm(differences, axis=0)
        worst = pairs[int(np.argmax(ratio))][0]
        expected[worst] = so_far
        left.remove(worst)
    assert found.p_values == pytest.approx(expected)


@pytest.mark.parametrize("units", [9, 30])
def test_the_order_of_units_and_models_does_not_matter(units):
    rng = np.random.default_rng(4)
    losses = losses_of(rng, [0.0, 0.3, 0.6, 0.9], units)
    order, models = rng.permutation(units), rng.permutation(4)
    there = model_confidence_set(losses[np.ix_(order, models)], 0.1)
    assert there.p_values == pytest.approx(
        model_confidence_set(losses, 0.1).p_values[models], abs=0
    )


def test_copies_of_a_model_share_its_fate():
    losses = np.random.default_rng(5).gamma(1.0, size=(10, 3)) + np.array([0.0, 0.2, 5.0])
    found = model_confidence_set(losses[:, [0, 2, 1, 2, 0]], 0.05)
    once = model_confidence_set(losses, 0.05)
    assert found.p_values == pytest.approx(once.p_values[[0, 2, 1, 2, 0]])
    assert model_confidence_set(np.ones((8, 4)), 0.05).p_values.tolist() == [1.0] * 4
    assert model_confidence_set(np.ones((8, 1)), 0.05).kept.tolist() == [True]


def test_useless_losses_are_refused():
    with pytest.raises(InputError, match="not finite"):
        model_confidence_set(np.array([[1.0, np.nan], [2.0, 3.0]]), 0.05)
    with pytest.raises(InputError, match="not \\(n units, m models\\)"):
        model_confidence_set(np.ones(3), 0.05)
    with pytest.raises(InputError, match="alpha"):
        model_confidence_set(np.ones((3, 2)), 1.0)
