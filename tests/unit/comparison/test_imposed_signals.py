"""Smoothing of imposed signals: as much as their noise asks for, and no more."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.comparison.link_inputs import sample_noise, smoothed

TIME = np.arange(800) / 100.0
MOTION = 0.4 * np.sin(2.0 * TIME)
STEPS = 3e5 - 1e5 * np.exp(-np.mod(TIME, 2.0) / 0.15)


@pytest.fixture
def rng():
    return np.random.default_rng(11)


def test_static_noise_moves_nothing(rng):
    left = [np.std(smoothed(TIME, 0.1 + rng.normal(0.0, 1e-3, TIME.size))) for _ in range(20)]
    # Four coefficients of 800 samples leave 0.07 of the noise; in some chance bends the spline.
    assert np.mean(left) < 0.2e-3
    assert np.quantile(left, 0.9) < 0.5e-3


@pytest.mark.parametrize(("signal", "noise"), [(MOTION, 1e-3), (STEPS, 400.0)])
def test_what_is_left_is_less_than_the_noise_and_not_shared_by_repeats(rng, signal, noise):
    errors = np.stack(
        [smoothed(TIME, signal + rng.normal(0.0, noise, TIME.size)) - signal for _ in range(12)]
    )
    assert np.sqrt(np.mean(errors**2)) < 0.6 * noise
    products = errors @ errors.T / TIME.size
    shared = (products.sum() - np.trace(products)) / (12 * 11)
    assert shared < (0.2 * noise) ** 2


def test_a_signal_without_noise_or_of_few_samples_stays_as_it_is():
    assert np.array_equal(smoothed(TIME, np.full(TIME.size, 2.0)), np.full(TIME.size, 2.0))
    assert np.array_equal(smoothed(TIME[:6], STEPS[:6]), STEPS[:6])


def test_steps_of_a_converter_are_noise():
    step = 2.0 * np.pi / 4096
    counted = np.floor(MOTION / step) * step
    assert sample_noise(counted) >= step / np.sqrt(12.0) * (1.0 - 1e-9)
    slow = np.floor(1e-3 * TIME / step) * step
    assert np.abs(np.diff(smoothed(TIME, slow))).max() < 0.2 * step


def test_units_do_not_matter(rng):
    noisy = STEPS + rng.normal(0.0, 400.0, TIME.size)
    assert smoothed(TIME, 1e-3 * noisy) == pytest.approx(1e-3 * smoothed(TIME, noisy), rel=1e-6)
