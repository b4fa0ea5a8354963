"""What is read off a step response and its noise."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import lfilter

from pamsim.recordings.step_metrics import rough_noise, step_metrics

TIME = np.arange(20001) / 2000.0  # 10 s


def oscillation(damping: float) -> np.ndarray:
    """Unit step response of a second-order system with a natural frequency of 5 rad/s."""
    root = math.sqrt(1.0 - damping**2)
    phase = 5.0 * root * TIME
    decay = np.exp(-damping * 5.0 * TIME)
    return 1.0 - decay * (np.cos(phase) + damping / root * np.sin(phase))


@pytest.mark.parametrize("gain", [1.0, -36.0])
def test_first_order_step_settles_after_ln_50_time_constants(gain):
    metrics = step_metrics(TIME, 3.0 + gain * (1.0 - np.exp(-TIME / 0.4)))
    assert metrics.start == 3.0
    assert metrics.final == pytest.approx(3.0 + gain, rel=1e-9)
    assert metrics.settling_time == pytest.approx(0.4 * math.log(50.0), abs=1e-3)
    assert metrics.overshoot == pytest.approx(0.0, abs=1e-9)
    assert metrics.reversal == 0.0


@pytest.mark.parametrize("damping", [0.2, 0.5])
@pytest.mark.parametrize("gain", [1.0, -36.0])
def test_second_order_step_overshoots_by_the_textbook_figure(damping, gain):
    metrics = step_metrics(TIME, gain * oscillation(damping))
    peak = math.exp(-math.pi * damping / math.sqrt(1.0 - damping**2))
    assert metrics.overshoot == pytest.approx(peak, rel=1e-3)
    assert metrics.reversal == pytest.approx(abs(gain) * (peak + peak**2), rel=1e-3)


def test_a_ramp_never_settles_and_a_constant_is_settled():
    assert math.isnan(step_metrics(TIME, TIME).settling_time)
    still = step_metrics(TIME, np.full_like(TIME, 2.0))
    assert (still.settling_time, still.overshoot, still.reversal) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("constants", np.arange(2.0, 8.1, 0.25))
@pytest.mark.parametrize("noise", [0.0, 2e-3])
def test_a_first_order_step_is_settled_only_where_2_percent_or_less_are_left(constants, noise):
    rng = np.random.default_rng(1)
    response = 1.0 - np.exp(-constants * TIME / TIME[-1]) + noise * rng.standard_normal(TIME.size)
    left = math.exp(-constants)
    if abs(left - 0.02) > 0.005:  # the final value is a mean, which lags a little
        assert math.isnan(step_metrics(TIME, response).settling_time) == (left > 0.02)


def test_a_motion_that_creeps_on_has_not_settled():
    """90 % at once, the rest with a time constant of twice the record."""
    creep = 1.0 - np.exp(-TIME / (2.0 * TIME[-1]))
    response = 0.9 * (1.0 - np.exp(-TIME / 0.2)) + 0.1 * creep
    assert math.isnan(step_metrics(TIME, response).settling_time)
    assert step_metrics(TIME, response - 0.1 * creep).settling_time < 1.0


SAMPLED = np.linspace(0.0, 8.0, 4000)


def test_planted_noise_is_found_on_a_moving_signal_with_jumps():
    signal = 1e5 * np.sin(SAMPLED) + 2e5 * (SAMPLED > 3.0)
    noise = np.random.default_rng(1).normal(0.0, 40.0, SAMPLED.size)
    assert rough_noise(signal + noise) == pytest.approx(40.0, rel=0.05)
    assert rough_noise(signal) < 1.0


def test_drift_shows_over_a_long_lag_only_and_too_few_samples_show_nothing():
    drift = lfilter([np.sqrt(1 - 0.95**2)], [1, -0.95], np.random.default_rng(2).normal(size=40000))
    assert rough_noise(drift) < 0.35
    assert rough_noise(drift, lag=200) == pytest.approx(1.0, rel=0.1)
    assert rough_noise(np.array([1.0, 5.0])) == 0.0
