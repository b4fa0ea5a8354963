"""Hum and single wrong readings are taken off; corners, peaks and noise stay."""

import numpy as np
import pytest

from pamsim.inference.clean_signal import without_hum, without_spikes

COUNT = 500
SAMPLE = np.arange(COUNT)
SLOW = 50.0 * np.sin(0.06 * SAMPLE)
SWITCHED = 6.0 * np.clip(np.abs(np.mod(SAMPLE, 90) - 45) - 15, 0, 15)


@pytest.mark.parametrize("per_sample", [0.27, 0.4, 0.499])
def test_a_hum_and_its_harmonic_are_taken_off_beside_a_signal_that_moves(per_sample: float):
    rng = np.random.default_rng(1)
    phase = 2.0 * np.pi * per_sample * SAMPLE
    hum = 1.5 * np.sin(phase + 0.4) + np.sin(2.0 * np.pi * 0.345 * SAMPLE)
    rest = SLOW + SWITCHED + rng.normal(0.0, 0.5, COUNT)
    left = without_hum(rest + hum) - rest
    assert np.sqrt(np.mean(left**2)) < 0.1 * np.sqrt(np.mean(hum**2))


def test_a_signal_without_hum_stays_as_it_is():
    rng = np.random.default_rng(2)
    changed = 0
    for _ in range(200):
        noisy = SLOW + SWITCHED + rng.normal(0.0, 0.5, COUNT)
        changed += without_hum(noisy) is not noisy
    assert changed <= 2  # of 0.2 expected
    for exact in (SLOW, SWITCHED, np.zeros(COUNT), SLOW[:20]):
        assert np.array_equal(without_hum(exact), exact)


READING = np.arange(400)
CORNERS = 12.0 * np.clip(np.abs(np.mod(READING, 90) - 45) - 15, 0, 15)
PEAKS = 12.0 * np.abs(np.mod(READING, 20) - 10.3)
WAVE = 50.0 * np.sin(0.3 * READING)
JUMPS = 0.001 * READING**2 + 200.0 * (np.mod(READING, 100) < 50)


@pytest.mark.parametrize(
    "signal", [CORNERS, PEAKS, WAVE, JUMPS], ids=["corners", "peaks", "wave", "jumps"]
)
def test_wrong_readings_alone_are_replaced(signal: np.ndarray):
    rng = np.random.default_rng(3)
    wrong = np.array([37, 120, 161, 330])
    for _ in range(20):
        noisy = signal + rng.normal(0.0, 1.0, signal.size)
        assert np.array_equal(without_spikes(noisy, 1.0), noisy)
        read = noisy.copy()
        read[wrong] += rng.choice([-1.0, 1.0], wrong.size) * 150.0
        left = without_spikes(read, 1.0)
        assert np.flatnonzero(left != read).tolist() == wrong.tolist()
        assert np.max(np.abs(left - noisy)) < 20.0  # of 150


def test_a_signal_without_noise_or_of_few_samples_stays():
    spike = np.where(READING == 9, 5.0, 0.0)
    assert np.array_equal(without_spikes(spike, 0.0), spike)
    assert np.array_equal(without_spikes(spike[7:11], 1e-3), spike[7:11])
    for exact in (CORNERS, PEAKS, WAVE, JUMPS):  # beside which any noise is small
        assert np.array_equal(without_spikes(exact, 1e-5), exact)
