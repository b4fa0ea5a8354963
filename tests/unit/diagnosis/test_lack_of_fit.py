"""What repeats share is found whatever the noise floor; what chance makes is not."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from pamsim.comparison.trial_residuals import TrialLayout
from pamsim.diagnosis.method.lack_of_fit import lack_of_fit
from pamsim.diagnosis.method.trial_diagnosis import diagnose_trials
from pamsim.diagnosis.method.verdict import Verdict
from pamsim.diagnosis.method.verdict_thresholds import LARGE_REMAINDER_LOSS
from pamsim.inference.residual_block import ResidualBlock, layout
from tests.unit.diagnosis.toy_arm import (
    BIAS,
    DRY,
    LEAK,
    NUISANCE,
    WIDE,
    recorded,
    regressors,
    simulator,
)

COUNT, PROTOCOLS = 300, 5
TIME = np.linspace(0.0, 1.0, COUNT)
SHARED = np.sin(2.0 * np.pi * 3.0 * TIME)


def lack(trials, jacobian=None, directions=None, seed=0):
    """Lack of fit of trials given as protocol -> residuals, all of noise 1."""
    blocks = [
        ResidualBlock(trial=f"{p}_{i}", protocol=str(p), channel="angle", residual=r)
        for p, members in trials.items()
        for i, r in enumerate(members)
    ]
    places = TrialLayout(places=layout(blocks), held_out=frozenset())
    residual = np.concatenate([b.residual for b in blocks])
    weights = places.weights({"angle": 1.0}) / np.sqrt(len(blocks))
    fitter = SimpleNamespace(
        simulator=SimpleNamespace(layout=places), weighted=lambda r: weights * r
    )
    empty = np.zeros((residual.size, 0))
    found = SimpleNamespace(residual=residual, jacobian=empty if jacobian is None else jacobian)
    traces = [SimpleNamespace(signature=SimpleNamespace(projected=d)) for d in directions or []]
    return lack_of_fit(fitter, found, [SimpleNamespace(traces=traces)], seed=seed)


def noisy(rng, shared, *, varying=0.0, repeats=4, counts=(COUNT,)):
    """Trials with something shared and something that differs, of the shape of a ramp."""
    return {
        p: [
            (shared + varying * rng.standard_normal() * TIME + rng.standard_normal(COUNT))[
                : counts[i % len(counts)]
            ]
            for i in range(repeats)
        ]
        for p in range(PROTOCOLS)
    }


def test_its_size_is_the_mean_square_of_what_is_shared():
    sizes = [lack(noisy(np.random.default_rng(s), 0.2 * SHARED)).size for s in range(20)]
    assert np.mean(sizes) == pytest.approx(0.5 * 0.2**2, rel=0.2)


def test_its_standard_error_is_the_scatter_of_the_size_where_nothing_is_shared():
    found = [lack(noisy(np.random.default_rng([21, s]), 0.0, repeats=3)) for s in range(200)]
    scatter = np.std([one.size for one in found])
    assert np.sqrt(np.mean([one.error**2 for one in found])) == pytest.approx(scatter, rel=0.15)
    for one in found:
        assert one.at_most == one.error + (one.size if one.size > 0.0 else 0.0)


@pytest.mark.parametrize("varying", [0.0, 1.0])
def test_chance_is_held_to_be_more_as_often_as_it_says(varying):
    found = [lack(noisy(np.random.default_rng([7, s]), 0.0, varying=varying)) for s in range(120)]
    p_values = np.array([one.p_value for one in found])
    for level in (0.1, 0.3, 0.5):
        assert np.mean(p_values < level) == pytest.approx(level, abs=0.11)
    assert not any(one.significant for one in found)


def test_a_remainder_far_below_the_noise_is_found():
    for seed in range(10):
        one = lack(noisy(np.random.default_rng([3, seed]), 0.4 * SHARED))
        assert one.significant, (seed, one)


def test_what_varies_from_trial_to_trial_does_not_hide_it():
    """In a direction of the library; without the direction it does."""
    ramp = np.tile(TIME, 4 * PROTOCOLS)
    missed = 0
    for seed in range(10):
        trials = noisy(np.random.default_rng([5, seed]), 0.4 * SHARED, varying=3.0)
        assert lack(trials, directions=[ramp]).significant, seed
        missed += not lack(trials).significant
    assert missed >= 8


def test_its_p_value_does_not_depend_on_the_unit_of_the_residuals():
    ramp = np.tile(TIME, 4 * PROTOCOLS)
    trials = noisy(np.random.default_rng(8), 0.4 * SHARED, varying=3.0)
    one = lack(trials, directions=[ramp])
    small = lack({p: [1e-3 * r for r in members] for p, members in trials.items()}, None, [ramp])
    assert small.p_value == one.p_value < 0.01
    assert small.size == pytest.approx(1e-6 * one.size, rel=1e-9)


def test_what_the_model_s_own_parameters_can_make_is_no_lack():
    rng = np.random.default_rng(2)
    trials = noisy(rng, 2.0 * SHARED)
    jacobian = np.tile(SHARED, 4 * PROTOCOLS)[:, np.newaxis]
    assert lack(trials).significant
    assert not lack(trials, jacobian=jacobian).significant


def test_repeats_are_compared_as_far_as_the_shortest_goes():
    rng = np.random.default_rng(4)
    counts = (COUNT, COUNT - 40)
    assert lack(noisy(rng, 0.5 * SHARED, counts=counts)).significant
    assert not lack(noisy(rng, 0.0 * SHARED, counts=counts)).significant


def test_without_repeats_nothing_is_held_to_be_shared():
    one = lack(noisy(np.random.default_rng(1), 5.0 * SHARED, repeats=1))
    assert (one.size, one.p_value, one.significant) == (0.0, 1.0, False)


def test_few_trials_cannot_make_it_sure():
    """Two repeats of one protocol have two sign patterns: nothing is surer than one in two."""
    rng = np.random.default_rng(6)
    one = lack({0: [SHARED + 0.01 * rng.standard_normal(COUNT) for _ in range(2)]})
    assert one.p_value == one.attainable == 0.5
    assert not one.testable
    assert not one.significant


@pytest.mark.parametrize(
    ("protocols", "repeats", "attainable", "testable"),
    [(5, 3, 4.0**-5, True), (3, 3, 4.0**-3, True), (5, 2, 2.0**-5, False), (6, 2, 2.0**-6, True),
     (8, 4, 1e-4, True)],
)  # fmt: skip
def test_a_large_remainder_counts_wherever_the_repeats_can_show_one(
    protocols, repeats, attainable, testable
):
    """Three repeats of five inputs reach 1/1024 at best: less than 0.001 can never be asked."""
    rng = np.random.default_rng(9)
    one = lack({
        p: [SHARED + rng.standard_normal(COUNT) for _ in range(repeats)] for p in range(protocols)
    })  # fmt: skip
    assert one.attainable == pytest.approx(attainable)
    assert one.p_value == one.attainable
    assert one.testable is one.significant is testable


def test_the_p_values_of_three_repeats_are_uniform_where_nothing_is_missing():
    """500 data sets with noise that drifts: at every level within its binomial error."""
    runs = 500
    p_values = np.empty(runs)
    for run in range(runs):
        rng = np.random.default_rng([11, run])
        drift = np.cumsum(rng.standard_normal((PROTOCOLS * 3, 60)), axis=1) / 5.0
        rest = (drift + rng.standard_normal(drift.shape)).reshape(PROTOCOLS, 3, 60)
        p_values[run] = lack(dict(enumerate(rest))).p_value
    for level in (0.02, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9):
        error = np.sqrt(level * (1.0 - level) / runs)
        assert np.mean(p_values <= level) == pytest.approx(level, abs=3.0 * error), level


def test_the_same_seed_gives_the_same_answer():
    trials = noisy(np.random.default_rng(8), 0.1 * SHARED)
    assert lack(trials, seed=3) == lack(trials, seed=3)


def test_a_name_that_only_resembles_the_truth_stands_for_its_kind():
    """Dry friction of another width: the library's explains nearly all of it, and is not it."""
    for seed in range(4):
        trials = recorded({"wide": 0.1}, seed=seed, repeats=8)
        near = diagnose_trials(
            simulator(trials), NUISANCE, (DRY, BIAS, LEAK), regressors(trials)
        ).conclusion
        assert near.verdict is Verdict.NAMED_WITH_REMAINDER, (seed, near.lack)
        assert near.best.names == ("dry",)
        assert near.explained.value > 0.99
        assert near.remainder < LARGE_REMAINDER_LOSS  # the noise floor alone would not show it


def test_rivals_that_lack_something_are_out():
    """The same data with both widths in the library: their losses hardly differ."""
    for seed in range(4):
        trials = recorded({"wide": 0.1}, seed=seed, repeats=8)
        named = diagnose_trials(
            simulator(trials), NUISANCE, (DRY, WIDE), regressors(trials)
        ).conclusion
        assert named.verdict is Verdict.NAMED
        assert named.best.names == ("wide",)
