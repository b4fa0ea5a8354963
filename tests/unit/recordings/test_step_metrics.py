"""What is read off a step response and its noise."""

import math

import numpy as np
import pytest
from scipy.signal import lfilter

from pamsim.recordings.step_metrics import rough_noise, step_metrics

TIME = np.arange(20001) / 2000.0  # 10 s


def test_first_order_step_settles_after_ln_50_time_constants():
    for gain in (1.0, -36.0):
        metrics = step_metrics(TIME, 3.0 + gain * (1.0 - np.exp(-TIME / 0.4)))
        assert (metrics.start, metrics.reversal) == (3.0, 0.0)
        assert metrics.final == pytest.approx(3.0 + gain, rel=1e-9)
        assert metrics.settling_time == pytest.approx(0.4 * math.log(50.0), abs=1e-3)
        assert metrics.overshoot == pytest.approx(0.0, abs=1e-9)


def test_second_order_step_overshoots_by_the_textbook_figure():
    for damping in (0.2, 0.5):
        root = math.sqrt(1.0 - damping**2)
        turned, decay = 5.0 * root * TIME, np.exp(-damping * 5.0 * TIME)
        response = 1.0 - decay * (np.cos(turned) + damping / root * np.sin(turned))
        peak = math.exp(-math.pi * damping / root)
        for gain in (1.0, -36.0):
            metrics = step_metrics(TIME, gain * response)
            assert metrics.overshoot == pytest.approx(peak, rel=1e-3)
            assert metrics.reversal == pytest.approx(abs(gain) * (peak + peak**2), rel=1e-3)


def test_what_is_still_on_its_way_has_overshot_nothing_and_what_turned_back_before_has():
    """A record ends beyond the mean of its end where it goes on: that is no overshoot."""
    slow = 1.0 - np.exp(-TIME / TIME[-1])
    for gain in (1.0, -36.0):
        for response in (TIME, TIME**2, slow):
            metrics = step_metrics(TIME, 3.0 + gain * response)
            assert math.isnan(metrics.settling_time)
            assert metrics.overshoot == 0.0
        swing = 0.3 * np.exp(-TIME / 0.5) * np.sin(8.0 * TIME) / slow.max()
        fast = 1.0 - np.exp(-TIME / 0.05) + swing + 0.01 * slow
        metrics = step_metrics(TIME, gain * fast)
        beyond = (gain * fast).max() if gain > 0.0 else (gain * fast).min()
        assert metrics.overshoot == pytest.approx(beyond / metrics.final - 1.0, rel=1e-9)
        assert metrics.overshoot > 0.1


def test_only_what_has_2_percent_or_less_left_is_settled():
    noise = np.random.default_rng(1).standard_normal(TIME.size)
    for constants in np.arange(2.0, 8.1, 0.5):
        left = math.exp(-constants)
        for size in (0.0, 2e-3):
            response = 1.0 - np.exp(-constants * TIME / TIME[-1]) + size * noise
            if abs(left - 0.02) > 0.005:  # the final value is a mean, which lags a little
                settled = not math.isnan(step_metrics(TIME, response).settling_time)
                assert settled == (left < 0.02), (constants, size)
    assert math.isnan(step_metrics(TIME, TIME).settling_time)  # a ramp
    still = step_metrics(TIME, np.full_like(TIME, 2.0))
    assert (still.settling_time, still.overshoot, still.reversal) == (0.0, 0.0, 0.0)
    # 90 % at once, the rest with a time constant of twice the record.
    prompt = 0.9 * (1.0 - np.exp(-TIME / 0.2))
    creeping = prompt + 0.1 * (1.0 - np.exp(-TIME / (2.0 * TIME[-1])))
    assert math.isnan(step_metrics(TIME, creeping).settling_time)
    assert step_metrics(TIME, prompt).settling_time < 1.0


def test_planted_noise_is_found_on_a_moving_signal_and_drift_over_a_long_lag_only():
    time = np.linspace(0.0, 8.0, 4000)
    signal = 1e5 * np.sin(time) + 2e5 * (time > 3.0)
    noise = np.random.default_rng(1).normal(0.0, 40.0, time.size)
    assert rough_noise(signal + noise) == pytest.approx(40.0, rel=0.05)
    assert rough_noise(signal) < 1.0
    drift = lfilter([np.sqrt(1 - 0.95**2)], [1, -0.95], np.random.default_rng(2).normal(size=40000))
    assert rough_noise(drift) < 0.35
    assert rough_noise(drift, lag=200) == pytest.approx(1.0, rel=0.1)
    assert rough_noise(np.array([1.0, 5.0])) == 0.0  # too few samples show nothing
