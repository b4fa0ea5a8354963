"""A further effect is found beside a wrong formula, and a wrong formula is not a further effect."""

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.inference.blocks import Block, Stack, correlation_length, cut, noise_from_repeats
from pamsim.inference.model_comparison import compare_paired
from pamsim.inference.projected_effect import FreeForms, compare_effects
from tests.unit.inference.closed_form_rigs import coloured

ROWS = 80


def free_forms(residual, jacobian, forms=None):
    count = len(residual)
    stack = Stack(
        units=tuple(map(str, range(count))),
        unit=np.arange(count),
        residual=residual,
        jacobian=jacobian,
    )
    return FreeForms(stack, jacobian[:, :0] if forms is None else forms)


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

    def claimed(self, forms):
        effect = free_forms(self.residual, self.columns, forms).effect(self.second)
        return bool(compare_effects([effect]).p_value[0] <= 0.05)


def test_a_wrong_form_is_no_second_effect_if_its_forms_are_free_and_a_second_one_is_found():
    """Free forms: claims at most at the level. The form that is used alone: nearly always."""
    rng, runs = np.random.default_rng(1), 60
    models = [Friction(rng) for _ in range(runs)]
    free = np.mean([model.claimed(model.forms) for model in models])
    assert free < 0.05 + 2 * np.sqrt(0.05 * 0.95 / runs)
    assert np.mean([model.claimed(None) for model in models]) > 0.8
    models = [Friction(rng, second=8.0) for _ in range(20)]
    assert np.mean([model.claimed(model.forms) for model in models]) > 0.9


def test_what_model_and_forms_can_give_changes_nothing():
    model = Friction(np.random.default_rng(5))
    free = free_forms(model.residual, model.columns, model.forms)
    inside = free.effect(model.forms @ [1.0, -2.0, 0.5] + model.columns[:, 2])
    assert np.array_equal(inside.losses, free.losses)
    assert not inside.scores.any()


def test_losses_are_those_of_fits_without_the_row():
    """Refits by hand, squares in units of the prediction's variance."""
    model = Friction(np.random.default_rng(6), second=3.0)
    free = free_forms(model.residual, model.columns, model.forms)
    effect = free.effect(model.second)
    columns = np.column_stack([model.columns, model.forms])
    wider = np.column_stack([columns, model.second])
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
        free_forms(model.residual + size * offset, columns).effect(model.second)
        for size in (0.0, 1000.0)
    ]
    assert effects[1].losses == pytest.approx(effects[0].losses)
    free = free_forms(model.residual, model.columns)
    assert free.effect(offset).losses[2] == pytest.approx(free.losses[2])


@pytest.mark.parametrize(("rows", "columns"), [(10, 5), (20, 6)])
def test_few_rows_and_many_columns_do_not_raise_the_level(rows, columns):
    """The fit makes rows share their residuals; flips of them as they are reject 15 % at 5 %."""
    rng, values = np.random.default_rng(rows), []
    runs = 500 if rows < 14 else 100  # patterns are drawn from 14 rows on
    for _ in range(runs):
        free = free_forms(rng.standard_normal(rows), rng.standard_normal((rows, columns)))
        values.append(compare_effects([free.effect(rng.standard_normal(rows))]).p_value[0])
    for level in (0.05, 0.25):
        assert np.mean(np.array(values) <= level) < level + 2 * np.sqrt(level * (1 - level) / runs)


def test_the_covariance_of_the_scores_is_that_of_noise():
    rng = np.random.default_rng(11)
    jacobian, signature = rng.standard_normal((10, 3)), rng.standard_normal(10)
    effects = [free_forms(rng.standard_normal(10), jacobian).effect(signature) for _ in range(3000)]
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
    sums = [[p.white(signature[p.rows]) @ p.white(e[p.rows]) for e in drawn] for p in parts]
    levels = np.arange(1, 2**10) / 2.0**10
    share = np.mean(compare_paired(np.array(sums)).p_value[:, np.newaxis] <= levels + 1e-9, axis=0)
    # A 95 % band of the whole distribution.
    assert np.max(np.abs(share - levels)) < np.sqrt(np.log(2 / 0.05) / (2 * runs))


def test_useless_input_is_refused():
    model = Friction(np.random.default_rng(8))
    with pytest.raises(InputError, match="forms of shape"):
        free_forms(model.residual, model.columns, model.forms[1:])
    with pytest.raises(InputError, match="two or more"):
        free_forms(model.residual[:1], model.columns[:1])
    two = np.ones(2)
    pair = Stack(units=("a",), unit=np.zeros(2, dtype=int), residual=two, jacobian=two[:, None])
    with pytest.raises(InputError, match="a unit of its own"):
        FreeForms(pair, two[:, None])
    with pytest.raises(InputError, match="signature"):
        free_forms(model.residual, model.columns).effect(np.full(ROWS, np.nan))
    with pytest.raises(InputError, match="no candidate"):
        compare_effects([])
