"""Noise that a lab states counts where the samples show less of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import pamsim
from pamsim.comparison.chain_runs import link_residuals
from pamsim.comparison.link_noise import link_noise
from pamsim.comparison.noise_floor import FloorRoute, noise_floor
from pamsim.comparison.start_errors import start_error
from pamsim.engine.rig import load_rig
from pamsim.inference.residual_block import layout
from pamsim.recordings.stated_noise import StatedNoise
from pamsim.recordings.trial import Trial

ARM = load_rig("mas20_arm")
FILTERED = StatedNoise(rms=2e-3, cutoff=3.0)  # rad, Hz


def recorded(names=("log",), noise=FILTERED):
    """Logs of the arm in motion whose angle was filtered."""
    rng = np.random.default_rng(4)
    levels = np.array([3.0, 3.5, 2.6, 3.2, 2.4, 3.0, 3.4, 2.8]) * 1e5  # Pa
    time = 0.3 * np.arange(levels.size)  # too short to settle
    command = np.column_stack([levels, 6e5 - levels])
    experiment = pamsim.Experiment(
        drive="pressure_set", command_time=time, command_value=command,
        start_pressure=command[0], duration=2.4, sample_rate=100.0,
    )  # fmt: skip
    run = pamsim.simulate(ARM, experiment).completed()
    return [
        Trial(
            name=name,
            protocol="levels",
            drive="pressure_set",
            load=0.0,
            time=run.time,
            command=run.command,
            measured={
                "angle": run.angle + noise.drawn(run.time.size, 0.01, rng),
                **{
                    f"pressure_{m + 1}": run.pressure[:, m] + 50.0 * rng.normal(size=run.time.size)
                    for m in range(2)
                },
            },
        )
        for name in names
    ]


def angle_noise(trials):
    exact = {
        (link, block.trial, block.channel): block.residual
        for link, blocks in link_residuals(ARM, trials).items()
        for block in blocks
    }
    found = link_noise(ARM, trials, exact)
    (one,) = (noise for (_, channel), noise in found.items() if channel == "angle")
    return one


def with_stated(trials, **noise):
    return [replace(trial, noise=noise) for trial in trials]


def test_drawn_noise_has_its_size_and_forgets_within_the_filters_time():
    drawn = FILTERED.drawn(200_000, 0.01, np.random.default_rng(1))
    assert np.std(drawn) == pytest.approx(FILTERED.rms, rel=0.03)
    correlation = np.mean(drawn[10:] * drawn[:-10]) / np.var(drawn)
    assert correlation == pytest.approx(np.exp(-2.0 * np.pi * 3.0 * 0.1), abs=0.02)
    white = StatedNoise(rms=1.0).drawn(100_000, 0.01, np.random.default_rng(2))
    assert abs(np.mean(white[1:] * white[:-1])) < 0.02


def test_a_filtered_log_hides_its_noise_until_it_is_stated():
    trials = recorded()
    hidden, stated = angle_noise(trials), angle_noise(with_stated(trials, angle=FILTERED))
    assert hidden.source is FloorRoute.WITHIN_TRIALS
    assert hidden.noise.standard_deviation < 0.5 * FILTERED.rms
    assert stated.source is FloorRoute.STATED
    assert stated.noise.standard_deviation == pytest.approx(FILTERED.rms, rel=0.3)  # one of 2.4 s
    assert stated.noise.correlation_time(0.01) > 3.0 * hidden.noise.correlation_time(0.01)


def test_less_than_what_shows_changes_nothing():
    trials = recorded()
    less = with_stated(trials, angle=StatedNoise(rms=1e-6))
    assert angle_noise(less) == angle_noise(trials)


def test_repeats_stay_repeats_and_have_the_stated_noise_at_least():
    trials = recorded(("a", "b", "c"), StatedNoise(rms=1e-4))
    found = angle_noise(with_stated(trials, angle=FILTERED))
    assert found.source is FloorRoute.REPEATS
    assert found.noise.standard_deviation == pytest.approx(FILTERED.rms, rel=0.3)


def test_floor_and_start_pressures_are_uncertain_by_what_is_stated():
    trials = with_stated(recorded(), angle=FILTERED, pressure_1=StatedNoise(rms=5e3))
    blocks = [block for found in link_residuals(ARM, trials).values() for block in found]
    floor = noise_floor(layout(blocks), np.concatenate([b.residual for b in blocks]), trials)
    assert floor.sd["angle"] == FILTERED.rms
    assert floor.variance["angle", "levels"] == pytest.approx(FILTERED.rms**2)
    first, second = start_error(trials[0], np.array([3e5, 3e5])).spread
    assert first > 10.0 * second
