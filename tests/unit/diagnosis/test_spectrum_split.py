"""Distortion is found at the lines where theory puts it, and noise is not taken for it."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.comparison.periodicity import samples_per_period
from pamsim.diagnosis.method.spectrum_split import spectrum_splits
from pamsim.recordings.excitation import held_levels, multisine, triangle
from pamsim.recordings.trial import Trial

RATE, PERIOD, COUNT = 100.0, 4.0, 800
TIME = np.arange(COUNT) / RATE
WAVE = multisine(TIME, PERIOD, 12, np.random.default_rng(1))


def trial(name, command=WAVE, time=TIME):
    return Trial(
        name=name, protocol="multisine", drive="pressure_set", load=0.0, time=time,
        command=np.stack([command, -command], axis=1), measured={},
    )  # fmt: skip


def split(residuals, **options):
    trials = [trial(f"t_{i}", **options) for i in range(len(residuals))]
    found = spectrum_splits(
        trials, {t.name: {"angle": r} for t, r in zip(trials, residuals, strict=True)}
    )
    return found[0] if found else None


def rms(values):
    return float(np.sqrt(np.mean(values**2)))


def test_a_linear_miss_shows_at_excited_lines_alone():
    delayed = np.roll(WAVE, 3)  # whole periods: a delay is linear
    one = split([delayed - WAVE])
    assert one.excited == pytest.approx(rms((delayed - WAVE)[400:]), rel=1e-9)
    assert max(one.even, one.odd, abs(one.mean)) < 1e-12
    assert (one.segments, one.noise) == (1, None)
    assert one.period == pytest.approx(PERIOD)


def test_a_square_is_even_and_a_cube_is_odd():
    even = split([WAVE**2])
    assert even.even == pytest.approx(np.std(WAVE[:400] ** 2), rel=1e-9)
    assert even.mean == pytest.approx(np.mean(WAVE[:400] ** 2))
    assert max(even.odd, even.excited) < 1e-12
    odd = split([WAVE**3])
    assert max(odd.even, abs(odd.mean)) < 1e-12
    assert odd.odd > 0.1 * odd.excited > 0.0
    assert np.hypot(odd.odd, odd.excited) == pytest.approx(rms(WAVE[:400] ** 3), rel=1e-9)


def test_the_transient_of_the_first_period_does_not_count():
    one = split([np.exp(-8.0 * TIME)])
    assert max(one.excited, one.even, one.odd, abs(one.mean)) < 1e-12


def test_noise_is_told_apart_from_distortion():
    rng = np.random.default_rng(2)
    noisy = [0.02 * WAVE**2 + rng.normal(0.0, 0.1, COUNT) for _ in range(6)]
    one = split(noisy)
    assert one.segments == 6
    assert one.noise == pytest.approx(0.1, rel=0.05)
    assert one.even == pytest.approx(0.02 * np.std(WAVE[:400] ** 2), abs=0.012)
    quiet = [split(list(rng.normal(0.0, 0.1, (6, COUNT)))) for _ in range(20)]
    # The mean square about zero is shared out evenly between above and below: no bias is left.
    assert 4 <= sum(q.odd > 0.0 for q in quiet) <= 16
    assert np.mean([q.odd**2 for q in quiet]) < 0.1**2 / 6 / 4


def test_every_line_counts_once_in_the_sum_of_squares():
    fastest = np.where(np.arange(COUNT) % 2 == 0, 1.0, -1.0)
    assert split([fastest]).even == pytest.approx(1.0)
    offsets = split([np.full(COUNT, 3.0), np.full(COUNT, 1.0)])
    assert (offsets.mean, offsets.noise) == pytest.approx((2.0, np.sqrt(2.0)))


def test_commands_without_a_period_are_left_out():
    steps = held_levels(TIME, 1.6, 6, np.random.default_rng(0))
    assert split([WAVE], command=steps) is None
    assert split([WAVE], command=triangle(TIME, 4.0, 0.6)) is None
    assert split([WAVE], command=np.ones(COUNT)) is None
    jitter = TIME + np.random.default_rng(0).uniform(0.0, 1e-3, COUNT)
    assert split([WAVE], time=np.sort(jitter)) is None


@pytest.mark.parametrize("written", [9, 7])
def test_the_smallest_period_is_found_in_rounded_numbers(written):
    rounded = np.array([float(f"{value:.{written}g}") for value in 2.5e5 + 1e5 * WAVE])
    assert samples_per_period(rounded[:, np.newaxis]) == 400
    assert samples_per_period(triangle(TIME, 2.0)[:, np.newaxis]) == 200
    held = np.append(rounded, rounded[-1])  # a record often ends with its last command once more
    assert samples_per_period(held[:, np.newaxis]) == 400
    assert samples_per_period(rounded[:-1, np.newaxis]) is None
