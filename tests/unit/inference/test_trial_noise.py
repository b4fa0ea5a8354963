"""Noise of trials: one model per sample time, white and of one size after whitening."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.inference.coloured_noise import fit_ar_noise
from pamsim.inference.trial_noise import fit_trial_noise, same_rates
from tests.unit.linear.planted import coloured

TIMES = (0.005, 0.1, 0.005)
LAG = 0.05


def drifting(seed):
    """Exponentially correlated noise of one time constant at every rate."""
    rng = np.random.default_rng(seed)
    return [coloured(rng, 2000, np.exp(-time / LAG)) for time in TIMES]


def test_trials_of_one_sample_time_share_a_model():
    assert same_rates((0.01, 0.1, 0.010001)) == [[0, 2], [1]]
    given = drifting(1)
    noise = fit_trial_noise(given, TIMES)
    fast, slow, again = noise.models
    assert fast is again
    assert fast == fit_ar_noise([given[0], given[2]])
    assert fast.correlation_time(0.005) == pytest.approx(LAG, rel=0.3)
    assert slow == fit_ar_noise([given[1]])


def test_whitened_trials_are_white_and_of_one_variance():
    given = drifting(2)
    noise = fit_trial_noise(given, TIMES)
    for i, own in enumerate(given):
        white = noise.whiten(own, i)
        assert np.mean(white**2) == pytest.approx(noise.variance, rel=0.1)
        assert abs(np.corrcoef(white[1:], white[:-1])[0, 1]) < 0.06
    assert noise.scaled(4.0).models[1].variance == pytest.approx(4.0 * noise.models[1].variance)


def test_independent_samples_are_those_of_each_trial():
    noise = fit_trial_noise(drifting(3), TIMES)
    slow = noise.models[1].correlation_time(0.1)
    alone = min(2000 * 0.1 / (2.0 * slow), 2000)
    assert noise.independent([0, 2000, 0]) == pytest.approx(alone)
    assert noise.independent([2000, 0, 0]) == pytest.approx(2000 * 0.005 / (2.0 * LAG), rel=0.3)
