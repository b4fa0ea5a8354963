"""What varies from trial to trial is no remainder of a model; what repeats share is one."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.diagnosis.method.evidence import losses
from pamsim.diagnosis.method.trial_variation import (
    TrialVariation,
    held_out_excess,
    trial_variation,
    without_variation,
)
from tests.unit.diagnosis.test_limits_and_next_experiment import fitted
from tests.unit.diagnosis.toy_arm import DRY, LEAK


def excess(fitter, residual, variation):
    """Mean over the held-out trials."""
    found = held_out_excess(fitter.simulator.layout, residual, fitter.floor, variation)
    return float(np.mean(list(found.values())))


def test_a_perfect_model_of_trials_that_vary_leaves_next_to_nothing():
    """Three repeats whose gain differs by 3 % look like a remainder, one way or the other."""
    raw, clean = [], []
    for seed in range(12):
        fitter, base, screened = fitted({}, (DRY, LEAK), seed=seed, repeats=3, variation=0.03)
        variation = trial_variation(fitter, base, screened)
        raw.append(excess(fitter, base.residual, None))
        clean.append(excess(fitter, base.residual, variation))
    assert np.std(raw) > 0.2
    assert np.max(np.abs(clean)) < 0.06


def test_an_error_of_the_nuisance_parameters_is_no_remainder():
    """They come from other trials, which vary too: the held-out ones share what they are off by."""
    fitter, base, screened = fitted({}, (DRY, LEAK), repeats=3)
    variation = trial_variation(fitter, base, screened)
    off = base.residual + 2.0 * variation.changes[:, 0]
    assert excess(fitter, off, None) > 0.2
    assert excess(fitter, off, variation) == pytest.approx(
        excess(fitter, base.residual, variation), abs=1e-6
    )


@pytest.mark.parametrize("seed", range(3))
def test_what_repeats_share_in_a_direction_that_varies_stays(seed):
    """A leak in every input is more than the variation of trials explains."""
    fitter, base, screened = fitted({"leak": 0.05}, (LEAK,), seed=seed, repeats=3)
    layout = fitter.simulator.layout
    leak = screened[0].traces[0].probe.values
    here, there = fitter.simulator.wholes([base.values, {**base.values, **leak}])
    known = trial_variation(fitter, base, screened)
    changes = np.column_stack([known.changes[:, :1], there - here])
    variation = TrialVariation(changes=changes, nuisance=1)
    raw = excess(fitter, base.residual, None)
    assert raw > 0.5
    assert excess(fitter, base.residual, variation) > 0.5 * raw
    left = without_variation(layout, base.residual, fitter.floor, variation)
    assert {trial.protocol for trial in left} == {"slow_check", "fast_check", "high_check"}


def test_without_known_variation_the_excess_is_that_of_the_losses():
    fitter, base, _ = fitted({"dry": 0.06}, (DRY,), repeats=3)
    layout = fitter.simulator.layout
    loss = losses(layout, base.residual, fitter.floor, held_out=True)
    none = TrialVariation(changes=np.zeros((base.residual.size, 0)))
    plain = held_out_excess(layout, base.residual, fitter.floor, None)
    same = held_out_excess(layout, base.residual, fitter.floor, none)
    assert list(plain) == list(loss)
    assert np.mean(list(same.values())) == pytest.approx(np.mean(list(plain.values())), rel=1e-9)


def test_a_trial_without_a_repeat_keeps_its_excess():
    fitter, base, screened = fitted({"dry": 0.06}, (DRY,), repeats=1)
    variation = trial_variation(fitter, base, screened)
    layout = fitter.simulator.layout
    assert without_variation(layout, base.residual, fitter.floor, variation) == []
    assert excess(fitter, base.residual, variation) == excess(fitter, base.residual, None)
