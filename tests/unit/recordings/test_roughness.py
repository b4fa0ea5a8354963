"""Noise is distinguished from the signal under it, drift from the given lag on."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from pamsim.recordings.roughness import rough_noise

TIME = np.linspace(0.0, 8.0, 4000)


def test_planted_noise_is_found_on_a_moving_signal_with_jumps():
    signal = 1e5 * np.sin(TIME) + 2e5 * (TIME > 3.0)
    noise = np.random.default_rng(1).normal(0.0, 40.0, TIME.size)
    assert rough_noise(signal + noise) == pytest.approx(40.0, rel=0.05)
    assert rough_noise(signal) < 1.0


def test_drift_shows_over_a_long_lag_only():
    drift = lfilter([np.sqrt(1 - 0.95**2)], [1, -0.95], np.random.default_rng(2).normal(size=40000))
    assert rough_noise(drift) < 0.35
    assert rough_noise(drift, lag=200) == pytest.approx(1.0, rel=0.1)


def test_too_few_samples_tell_nothing():
    assert rough_noise(np.array([1.0, 5.0])) == 0.0
