"""Excitations do what they are for: constant rates, silent lines, even levels, opposite bursts."""

import numpy as np
import pytest

from pamsim.recordings.excitation import bursts, held_levels, multisine, triangle

TIME = np.arange(3200) / 400.0


def test_triangle_has_one_rate_and_starts_upwards():
    wave = triangle(TIME, 4.0)
    rate = np.diff(wave) * 400.0
    assert wave[0] == 0.0
    assert rate[0] > 0.0
    assert np.abs(rate) == pytest.approx(np.ones(rate.size), rel=1e-9)
    assert (wave.min(), wave.max()) == pytest.approx((-1.0, 1.0))
    wave = triangle(TIME, 4.0, shrink=0.6)  # draws smaller loops
    assert np.abs(wave[:1600]).max() == pytest.approx(1.0)
    assert np.abs(wave[1600:]).max() == pytest.approx(0.6)


def test_levels_cover_the_range_evenly_and_hold():
    wave = held_levels(TIME, 0.5, 4, np.random.default_rng(1))
    held = wave.reshape(16, 200)
    assert np.all(held == held[:, :1])
    levels, counts = np.unique(held[:, 0], return_counts=True)
    assert levels == pytest.approx([-1.0, -1 / 3, 1 / 3, 1.0])
    assert np.all(counts == 4)


def test_multisine_is_silent_at_even_and_detection_lines():
    wave = multisine(TIME, 8.0, 12, np.random.default_rng(2))
    lines = np.abs(np.fft.rfft(wave)) / wave.size
    excited = [1, 3, 7, 9, 11, 15, 17, 19, 23]
    assert lines[excited].min() > 1e-3
    silent = np.setdiff1d(np.arange(lines.size), excited)
    assert lines[silent].max() < 1e-12
    assert np.abs(wave).max() == pytest.approx(1.0, abs=0.02)


def test_bursts_come_in_opposite_pairs_with_shut_holds():
    wave = bursts(TIME, 0.8, 0.05, 0.2, np.random.default_rng(3))
    parts = wave.reshape(10, 320)
    assert set(np.unique(wave)) == {-1.0, 0.0, 1.0}
    lengths = np.abs(parts).sum(axis=1) / 400.0
    assert np.all((lengths >= 0.05 - 1e-2) & (lengths <= 0.2 + 1e-2))
    assert parts.sum(axis=1)[::2] == pytest.approx(-parts.sum(axis=1)[1::2])
    assert np.all(parts[:, 100:] == 0.0)
