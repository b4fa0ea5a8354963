"""Rows at rest: a further effect is found beside a wrong formula, and what near rows miss."""

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.inference.blocks import Block, correlation_length, cut, noise_from_repeats
from pamsim.inference.model_comparison import compare_paired
from pamsim.inference.row_tests import (
    UnseenRows,
    best_of_many_p_values,
    missed_together,
    nearest_units,
)
from tests.unit.inference.closed_form_rigs import coloured

ROWS = 80


class Friction:
    """Rows of a linear model, whitened: the first effect in several forms, a second beside it.

    The first effect acts as ``tanh(3 v)``; the model has it as ``sign(v)``, and other forms are
    known. The second looks like what is between the two.
    """

    def __init__(self, rng, *, first=20.0, second=0.0):
        speed = np.sin(2.0 * np.pi * rng.uniform(size=ROWS))
        used, true = np.sign(speed), np.tanh(3.0 * speed)
        self.forms = np.stack([np.tanh(2.0 * speed), np.tanh(3.5 * speed), true], axis=1)
        self.columns = np.stack([np.ones(ROWS), speed, used], axis=1)
        self.second = 0.5 * (true - used) + 0.15 * rng.standard_normal(ROWS)
        noise = rng.standard_normal(ROWS)
        self.residual = -(first * true + second * self.second) + noise

    @property
    def free(self):
        """Columns of the model and of all forms."""
        return np.hstack([self.columns, self.forms])

    def claimed(self, columns):
        return UnseenRows(self.residual, columns).effect(self.second).p_value() <= 0.05


def test_a_wrong_form_is_no_second_effect_if_its_forms_are_free_and_a_second_one_is_found():
    """Free forms: claims at most at the level. The form that is used alone: nearly always."""
    rng, runs = np.random.default_rng(1), 60
    models = [Friction(rng) for _ in range(runs)]
    free = np.mean([model.claimed(model.free) for model in models])
    assert free < 0.05 + 2 * np.sqrt(0.05 * 0.95 / runs)
    assert np.mean([model.claimed(model.columns) for model in models]) > 0.8
    models = [Friction(rng, second=8.0) for _ in range(20)]
    assert np.mean([model.claimed(model.free) for model in models]) > 0.9


def test_what_model_and_forms_can_give_changes_nothing():
    model = Friction(np.random.default_rng(5))
    free = UnseenRows(model.residual, model.free)
    inside = free.effect(model.forms @ [1.0, -2.0, 0.5] + model.columns[:, 2])
    assert np.array_equal(inside.losses, free.losses)
    assert not inside.scores.any()


def test_losses_are_those_of_fits_without_the_row():
    """Refits by hand, squares in units of the prediction's variance."""
    model = Friction(np.random.default_rng(6), second=3.0)
    free = UnseenRows(model.residual, model.free)
    effect = free.effect(model.second)
    columns, wider = model.free, np.column_stack([model.free, model.second])
    for i in range(ROWS):
        rest = np.arange(ROWS) != i
        fit, both = (
            np.linalg.lstsq(c[rest], -model.residual[rest], rcond=None)[0] for c in (columns, wider)
        )
        gram = columns[rest].T @ columns[rest]
        variance = 1.0 + columns[i] @ np.linalg.solve(gram, columns[i])
        before = model.residual[i] + columns[i] @ fit
        assert free.losses[i] == pytest.approx(before**2 / variance)
        after = model.residual[i] + wider[i] @ both
        assert effect.losses[i] == pytest.approx(after**2 / variance)


def test_a_direction_that_one_row_alone_shows_does_not_count():
    model = Friction(np.random.default_rng(7), second=3.0)
    offset = np.where(np.arange(ROWS) == 2, 1.0, 0.0)
    columns = np.column_stack([model.columns, offset])
    effects = [
        UnseenRows(model.residual + size * offset, columns).effect(model.second)
        for size in (0.0, 1000.0)
    ]
    assert effects[1].losses == pytest.approx(effects[0].losses)
    free = UnseenRows(model.residual, model.columns)
    assert free.effect(offset).losses[2] == pytest.approx(free.losses[2])


@pytest.mark.parametrize(("rows", "columns"), [(10, 5), (20, 6)])
def test_few_rows_and_many_columns_do_not_raise_the_level(rows, columns):
    """The fit makes rows share their residuals; flips of them as they are reject 15 % at 5 %."""
    rng, values = np.random.default_rng(rows), []
    runs = 500 if rows < 14 else 100  # patterns are drawn from 14 rows on
    for _ in range(runs):
        free = UnseenRows(rng.standard_normal(rows), rng.standard_normal((rows, columns)))
        values.append(free.effect(rng.standard_normal(rows)).p_value())
    for level in (0.05, 0.25):
        assert np.mean(np.array(values) <= level) < level + 2 * np.sqrt(level * (1 - level) / runs)


def test_the_covariance_of_the_scores_is_that_of_noise():
    rng = np.random.default_rng(11)
    jacobian, signature = rng.standard_normal((10, 3)), rng.standard_normal(10)
    effects = [UnseenRows(rng.standard_normal(10), jacobian).effect(signature) for _ in range(3000)]
    covariance = effects[0].score_covariance
    assert np.cov(np.stack([e.scores for e in effects]).T) == pytest.approx(covariance, abs=0.2)
    left = signature - jacobian @ np.linalg.lstsq(jacobian, signature, rcond=None)[0]
    assert np.sum(covariance) == pytest.approx(left @ left)


def test_purged_parts_of_one_drifting_log_are_units():
    """Noise with a memory, known from repeats; sums over ten parts of one log hold the level."""
    rng, runs = np.random.default_rng(12), 300
    noise = noise_from_repeats([np.stack([coloured(rng, 1500, 0.9) for _ in range(3)])])
    log = Block(unit="log", channel="angle", rows=slice(0, 1500), noise=noise)
    parts = cut(log, 10, correlation_length(noise, 3000))
    signature = np.sign(np.sin(20.0 * np.linspace(0.0, 1.0, 1500) + 0.5))
    drawn = [coloured(rng, 1500, 0.9) for _ in range(runs)]
    sums = [[p.white(signature[p.rows]) @ p.white(e[p.rows]) for p in parts] for e in drawn]
    levels = np.arange(1, 2**10) / 2.0**10
    p_values = np.array([compare_paired(np.array(own))[1] for own in sums])
    share = np.mean(p_values[:, np.newaxis] <= levels + 1e-9, axis=0)
    # A 95 % band of the whole distribution.
    assert np.max(np.abs(share - levels)) < np.sqrt(np.log(2 / 0.05) / (2 * runs))


def test_useless_input_is_refused():
    model = Friction(np.random.default_rng(8))
    with pytest.raises(InputError, match="two or more"):
        UnseenRows(model.residual[:1], model.columns[:1])
    with pytest.raises(InputError, match="signature"):
        UnseenRows(model.residual, model.columns).effect(np.full(ROWS, np.nan))


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
