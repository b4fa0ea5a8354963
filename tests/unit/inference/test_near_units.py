"""What near units miss together is found, and noise alone is not, however it scatters."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.inference.near_units import missed_together, nearest_units

RUNS, ROWS = 200, 14


def table(rng):
    """Inputs in a plane, and columns that a model has fitted."""
    inputs = rng.uniform(size=(ROWS, 2))
    jacobian = np.stack([np.ones(ROWS), inputs[:, 0], inputs[:, 1] ** 2], axis=1)
    return inputs, jacobian


def left(jacobian, values):
    basis, _ = np.linalg.qr(jacobian)
    return values - basis @ (basis.T @ values)


@pytest.mark.parametrize("scatter", [1.0, 4.0])
def test_noise_alone_is_found_as_often_as_the_level_says(scatter):
    found = []
    for seed in range(RUNS):
        rng = np.random.default_rng([seed, 1])
        inputs, jacobian = table(rng)
        spread = np.where(inputs[:, 0] > 0.5, scatter, 1.0)
        rows = left(jacobian, spread * rng.standard_normal(ROWS))
        found.append(missed_together(rows, jacobian, nearest_units(inputs), seed=seed))
    p_values = np.array([p_value for _, p_value in found])
    # Of 200 at a level of 5 %, more than 18 are a chance of 1 in 100.
    assert np.sum(p_values <= 0.05) <= 18
    assert abs(np.mean([excess for excess, _ in found])) < 0.2 * scatter**2


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
    rows = left(jacobian, rng.standard_normal(ROWS))
    order = rng.permutation(ROWS)
    one = missed_together(rows, jacobian, nearest_units(inputs))
    other = missed_together(rows[order], jacobian[order], nearest_units(inputs[order]))
    assert one == pytest.approx(other)
