"""A hum is taken off at any frequency above a quarter of the sampling rate, and nothing else is."""

import numpy as np
import pytest

from pamsim.inference.hum import without_hum

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
