"""Single wrong readings are replaced; corners, peaks and noise stay."""

import numpy as np
import pytest

from pamsim.inference.spikes import without_spikes

SAMPLE = np.arange(400)
CORNERS = 12.0 * np.clip(np.abs(np.mod(SAMPLE, 90) - 45) - 15, 0, 15)
PEAKS = 12.0 * np.abs(np.mod(SAMPLE, 20) - 10.3)
WAVE = 50.0 * np.sin(0.3 * SAMPLE)
JUMPS = 0.001 * SAMPLE**2 + 200.0 * (np.mod(SAMPLE, 100) < 50)


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
    spike = np.where(SAMPLE == 9, 5.0, 0.0)
    assert np.array_equal(without_spikes(spike, 0.0), spike)
    assert np.array_equal(without_spikes(spike[7:11], 1e-3), spike[7:11])
    for exact in (CORNERS, PEAKS, WAVE, JUMPS):  # beside which any noise is small
        assert np.array_equal(without_spikes(exact, 1e-5), exact)
