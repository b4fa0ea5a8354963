"""Criteria: those of the textbooks; slow noise, few samples and rounding decide nothing."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import lfilter

from pamsim.inference.coloured_noise import fit_ar_noise
from pamsim.inference.criteria import aicc_above_best, hannan_quinn


def slow_noise(seed, n=1000, phi=0.9):
    draw = np.random.default_rng(seed)
    return lfilter([1.0], [1.0, -phi], draw.normal(size=n + 200))[200:]


def test_white_residuals_have_the_criterion_of_the_book():
    residual = np.random.default_rng(2).normal(size=500)
    assert fit_ar_noise([residual]).order == 0
    found = hannan_quinn([residual], [0.01], 3)
    expected = 500 * np.log(np.mean(residual**2)) + 2.0 * np.log(np.log(500)) * 3
    assert found == pytest.approx(expected, rel=1e-12)


def test_what_takes_up_slow_noise_is_not_preferred_but_a_real_effect_is():
    along = np.linspace(-1.0, 1.0, 1000)
    bends = np.vander(along, 8, increasing=True)
    preferred = detected = 0
    for seed in range(20):
        noise = slow_noise(seed)
        left = noise - bends @ np.linalg.lstsq(bends, noise, rcond=None)[0]
        preferred += hannan_quinn([left], [0.01], 8) < hannan_quinn([noise], [0.01], 1)
        effect = noise + 2.0 * np.sign(np.sin(40.0 * along))
        detected += hannan_quinn([noise], [0.01], 2) < hannan_quinn([effect], [0.01], 1)
    assert preferred <= 2
    assert detected == 20


def test_trials_are_pooled_and_rounding_is_equal():
    noise = slow_noise(3)
    apart = hannan_quinn([noise[:500], noise[500:]], [0.01, 0.01], 2)
    assert apart == pytest.approx(hannan_quinn([noise], [0.01], 2), abs=20.0)
    residual = 1e-12 * np.random.default_rng(2).normal(size=100)
    assert hannan_quinn([residual], [0.01], 2, rounding=1.0) > hannan_quinn(
        [0.1 * residual], [0.01], 1, 1.0
    )
    assert np.isfinite(hannan_quinn([np.zeros(100)], [0.01], 2))


def test_with_many_samples_aicc_is_that_of_the_textbook():
    found = aicc_above_best([2.0, 1.0, 0.99], [2.0, 3.0, 4.0], 50.0)
    stated = [
        50.0 * math.log(square) + 2.0 * k + 2.0 * k * (k + 1.0) / (50.0 - k - 1.0)
        for square, k in ((2.0, 2.0), (1.0, 3.0), (0.99, 4.0))
    ]
    assert found == pytest.approx([score - min(stated) for score in stated])
    assert found[1] == 0.0


def test_of_equal_errors_the_fit_with_fewer_unknowns_is_best():
    for samples in (0.5, 3.0, 30.0):
        first, second, third = aicc_above_best([1.0, 1.0, 1.0], [2.0, 3.0, 9.0], samples)
        assert first == 0.0 < second < third


@pytest.mark.parametrize("samples", [3.0, 5.0, 9.0])
def test_few_samples_still_tell_missing_nearly_all_from_missing_nearly_nothing(samples):
    """The step of an arm is worth three samples: an integrator was best, with 40 % fit."""
    scores = aicc_above_best([0.36, 2e-4, 1.9e-4], [2.0, 4.0, 12.0], samples)
    assert scores[1] == 0.0
    assert aicc_above_best([1.0, 0.0], [1.0, 2.0], samples)[1] == 0.0  # no error at all
