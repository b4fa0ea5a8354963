"""A further effect is found beside a wrong formula, and a wrong formula is not a further effect."""

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.inference.blocks import (
    Block,
    Stack,
    correlation_length,
    cut,
    noise_from_repeats,
    unit_names,
    whitened,
)
from pamsim.inference.model_comparison import compare_with_reference
from pamsim.inference.projected_effect import FreeForms, compare_effects
from tests.unit.inference.closed_form_rigs import coloured

ROWS = 80


def stacked(residual, jacobian, units):
    return Stack(
        units=tuple(map(str, range(units))),
        unit=np.repeat(np.arange(units), len(residual) // units),
        residual=residual,
        jacobian=jacobian,
    )


class Friction:
    """Units of a linear model, whitened: the first effect in several forms, a second beside it.

    The first effect acts as ``tanh(3 v)``; the model has it as ``sign(v)``, and other forms are
    known. The second looks like what is between the two.
    """

    def __init__(self, rng, units):
        self.units = units
        time = np.linspace(0.0, 1.0, ROWS, endpoint=False)
        speed = np.concatenate(
            [
                np.sin(2 * np.pi * (time + rng.uniform())) * rng.uniform(0.5, 1.0)
                for _ in range(units)
            ]
        )
        self.nuisance = np.stack([np.ones(speed.size), speed], axis=1)
        self.used, self.true = np.sign(speed), np.tanh(3.0 * speed)
        self.forms = np.stack([np.tanh(2.0 * speed), np.tanh(3.5 * speed), self.true], axis=1)
        place = rng.standard_normal(speed.size)
        self.second = 0.5 * (self.true - self.used) + 0.15 * place

    def data(self, rng, *, first=20.0, second=0.0):
        """Whitened residual of the model, fitted with the form that it has."""
        noise = rng.standard_normal(self.true.size)
        residual = -(first * self.true + second * self.second) + noise
        return stacked(residual, np.column_stack([self.nuisance, self.used]), self.units)


def claimed(stack, forms, signature):
    free = FreeForms(stack, forms)
    effect = free.effect(signature)
    losses = compare_with_reference(free.losses, effect.losses[:, np.newaxis])
    return bool(losses.p_value[0] <= 0.05)


def test_a_wrong_form_is_no_second_effect_if_its_forms_are_free():
    """Free forms: claims at most at the level. The form that is used alone: nearly always."""
    rng = np.random.default_rng(1)
    runs, free, alone = 200, 0, 0
    for _ in range(runs):
        model = Friction(rng, 8)
        data = model.data(rng)
        free += claimed(data, model.forms, model.second)
        alone += claimed(data, model.forms[:, :0], model.second)
    assert free / runs < 0.05 + 2 * np.sqrt(0.05 * 0.95 / runs)
    assert alone / runs > 0.9


def test_a_second_effect_behind_a_wrong_form_is_found():
    rng = np.random.default_rng(2)
    runs, found = 60, 0
    for _ in range(runs):
        model = Friction(rng, 8)
        found += claimed(model.data(rng, second=4.0), model.forms, model.second)
    assert found / runs > 0.9


def test_what_model_and_forms_can_give_changes_nothing():
    rng = np.random.default_rng(5)
    model = Friction(rng, 4)
    free = FreeForms(model.data(rng), model.forms)
    inside = free.effect(model.forms @ [1.0, -2.0, 0.5] + model.used)
    assert np.array_equal(inside.losses, free.losses)
    assert not inside.scores.any()


def test_losses_are_those_of_fits_without_the_unit():
    """Refits by hand, squares in units of the prediction's covariance."""
    rng = np.random.default_rng(6)
    model = Friction(rng, 5)
    data = model.data(rng, second=3.0)
    free = FreeForms(data, model.forms)
    effect = free.effect(model.second)
    columns = np.column_stack([data.jacobian, model.forms])
    wider = np.column_stack([columns, model.second])
    for u in range(5):
        own = data.unit == u
        fit, both = (
            np.linalg.lstsq(c[~own], -data.residual[~own], rcond=None)[0] for c in (columns, wider)
        )
        spread = columns[own] @ np.linalg.inv(columns[~own].T @ columns[~own]) @ columns[own].T
        metric = np.linalg.inv(np.eye(ROWS) + spread)
        before = data.residual[own] + columns[own] @ fit
        assert free.losses[u] == pytest.approx(before @ metric @ before / ROWS)
        after = data.residual[own] + wider[own] @ both
        assert effect.losses[u] == pytest.approx(after @ metric @ after / ROWS)


def test_a_direction_that_one_unit_alone_shows_does_not_count():
    rng = np.random.default_rng(7)
    model = Friction(rng, 4)
    data = model.data(rng, second=3.0)
    offset = np.where(data.unit == 2, 1.0, 0.0)
    effects = []
    for size in (0.0, 1000.0):
        moved = stacked(data.residual + size * offset, np.column_stack([data.jacobian, offset]), 4)
        effects.append(FreeForms(moved, model.forms).effect(model.second))
    assert effects[1].losses == pytest.approx(effects[0].losses)
    only = FreeForms(data, model.forms).effect(offset * rng.standard_normal(offset.size))
    assert only.losses[2] == pytest.approx(FreeForms(data, model.forms).losses[2])


def has_its_level(values, units, runs):
    """Whether p-values are uniform within a 95 % band of the whole distribution."""
    levels = np.arange(1, 2**units) / 2.0**units
    share = np.mean(np.array(values)[:, np.newaxis] <= levels + 1e-9, axis=0)
    return np.max(np.abs(share - levels)) < np.sqrt(np.log(2 / 0.05) / (2 * runs))


def test_scores_of_an_absent_effect_have_either_sign():
    units = 5
    rng = np.random.default_rng(units)
    values = []
    for _ in range(500):
        model = Friction(rng, units)
        effect = FreeForms(model.data(rng), model.forms).effect(model.second)
        values.append(compare_effects([effect]).p_value[0])
    assert has_its_level(values, units, 500)


@pytest.mark.parametrize(("units", "rows", "columns"), [(10, 1, 5), (5, 4, 6)])
def test_few_rows_and_many_columns_do_not_raise_the_level(units, rows, columns):
    """The fit makes units share their residuals; flips of them as they are reject 15 % at 5 %."""
    rng = np.random.default_rng(units)
    runs, values = 500, []
    for _ in range(runs):
        jacobian = rng.standard_normal((units * rows, columns))
        data = stacked(rng.standard_normal(units * rows), jacobian, units)
        effect = FreeForms(data, jacobian[:, :0]).effect(rng.standard_normal(units * rows))
        values.append(compare_effects([effect]).p_value[0])
    for level in (0.05, 0.25):
        assert np.mean(np.array(values) <= level) < level + 2 * np.sqrt(level * (1 - level) / runs)


def test_the_covariance_of_the_scores_is_that_of_noise():
    rng = np.random.default_rng(11)
    jacobian, signature = rng.standard_normal((30, 4)), rng.standard_normal(30)
    effects = [
        FreeForms(stacked(rng.standard_normal(30), jacobian, 5), jacobian[:, :0]).effect(signature)
        for _ in range(2000)
    ]
    covariance = effects[0].score_covariance
    assert np.cov(np.stack([e.scores for e in effects]).T) == pytest.approx(covariance, abs=0.5)
    left = signature - jacobian @ np.linalg.lstsq(jacobian, signature, rcond=None)[0]
    assert np.sum(covariance) == pytest.approx(left @ left)


def test_purged_parts_of_one_drifting_log_are_units():
    """Noise with a memory, known from repeats; ten parts of one log hold the level."""
    rng = np.random.default_rng(12)
    noise = noise_from_repeats([np.stack([coloured(rng, 1500, 0.9) for _ in range(3)])])
    log = Block(unit="log", channel="angle", rows=slice(0, 1500), noise=noise)
    parts = cut(log, 10, correlation_length(noise, 3000))
    time = np.linspace(0.0, 1.0, 1500)
    columns = np.stack([np.ones(1500), np.sin(20.0 * time)], axis=1)
    values = []
    for _ in range(300):
        data = Stack(
            units=unit_names(parts),
            unit=np.repeat(np.arange(len(parts)), [part.size for part in parts]),
            residual=whitened(parts, coloured(rng, 1500, 0.9)),
            jacobian=whitened(parts, columns),
        )
        free = FreeForms(data, np.empty((data.residual.size, 0)))
        effect = free.effect(whitened(parts, np.sign(np.sin(20.0 * time + 0.5))))
        values.append(compare_effects([effect]).p_value[0])
    assert has_its_level(values, 10, 300)


def test_useless_input_is_refused():
    rng = np.random.default_rng(8)
    model = Friction(rng, 3)
    data = model.data(rng)
    with pytest.raises(InputError, match="forms of shape"):
        FreeForms(data, model.forms[1:])
    with pytest.raises(InputError, match="two or more"):
        FreeForms(stacked(data.residual, data.jacobian, 1), model.forms)
    with pytest.raises(InputError, match="signature"):
        FreeForms(data, model.forms).effect(np.full(3 * ROWS, np.nan))
    with pytest.raises(InputError, match="no candidate"):
        compare_effects([])
