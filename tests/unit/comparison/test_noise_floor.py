"""The floor that recordings have: by repeats, periods, holds, or from sample to sample."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from pamsim.comparison.noise_floor import (
    FloorRoute,
    noise_floor,
    noise_within_trial,
    settled_holds,
)
from pamsim.inference.residual_block import ResidualBlock, layout

INTERVAL, COUNT = 0.01, 6000
TIME = INTERVAL * np.arange(COUNT)
MISSED = 3.0 * np.sin(2.0 * np.pi * TIME / 4.0)  # what the model misses, every period again


def blocks(rng, *, repeats, count=400, model=0.0):
    time = np.linspace(0.0, 6.0, count)
    return [
        ResidualBlock(
            trial=f"{protocol}_{k}",
            protocol=protocol,
            channel=channel,
            residual=model * np.sin(time) + sd * rng.standard_normal(count),
        )
        for protocol, factor in (("calm", 1.0), ("rough", 3.0))
        for k in range(repeats)
        for channel, sd in (("angle", 0.1 * factor), ("pressure_1", 20.0 * factor))
    ]


def test_floor_is_the_planted_noise_whatever_the_model_misses():
    for model in (0.0, 50.0):
        found = blocks(np.random.default_rng(3), repeats=5, model=model)
        places = layout(found)
        floor = noise_floor(places, np.concatenate([b.residual for b in found]))
        assert floor.variance["angle", "calm"] == pytest.approx(0.01, rel=0.1)
        assert floor.variance["pressure_1", "rough"] == pytest.approx(3600.0, rel=0.1)
        assert floor.sd["angle"] == pytest.approx(np.sqrt((0.01 + 0.09) / 2.0), rel=0.05)


def drifting(rng):
    """Noise of variance 1, half of which drifts with a correlation time of 0.3 s."""
    keep = np.exp(-INTERVAL / 0.3)
    drive = rng.standard_normal(COUNT + 500)
    drift = lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], drive)[500:]
    return np.sqrt(0.5) * (rng.standard_normal(COUNT) + drift)


def stairs(hold):
    """A command of random levels, each held for a time [s]."""
    levels = np.random.default_rng(9).uniform(1.0, 3.0, COUNT)
    return levels[(TIME / hold).astype(int)][:, np.newaxis]


def test_periods_are_repeats_that_drift_counts_in_and_model_error_does_not():
    command = np.sin(2.0 * np.pi * TIME / 4.0)[:, np.newaxis]
    rng = np.random.default_rng(0)
    route, noise = noise_within_trial(MISSED + drifting(rng), INTERVAL, command)
    assert route is FloorRoute.PERIODS
    assert noise.variance == pytest.approx(1.0, rel=0.15)
    assert noise.freedom == 13 * 400  # of 15 periods, the first is a transient


def test_holds_give_the_noise_where_the_model_misses_another_level_in_each():
    command = stairs(3.0)
    steps = 20.0 * command[:, 0]  # what the model misses
    rng = np.random.default_rng(1)
    route, noise = noise_within_trial(steps + drifting(rng), INTERVAL, command)
    assert route is FloorRoute.HOLDS
    # Over 0.5 s, second differences see 3/4 of a drift of 0.3 s.
    assert 0.75 < noise.variance < 1.0
    holds = settled_holds(command, INTERVAL)
    assert [h.stop - h.start for h in holds] == [250] * 20
    assert all(np.ptp(command[h]) == 0.0 for h in holds)


@pytest.mark.parametrize("command", [None, stairs(1.0)])
def test_otherwise_noise_is_what_changes_from_sample_to_sample(command):
    rng = np.random.default_rng(2)
    white = MISSED + 0.3 * rng.standard_normal(COUNT)
    route, noise = noise_within_trial(white, INTERVAL, command)
    assert route is FloorRoute.WITHIN_TRIALS
    assert noise.variance == pytest.approx(0.09, rel=0.1)
    _, half = noise_within_trial(drifting(rng), INTERVAL, command)
    assert half.variance == pytest.approx(0.5, rel=0.15)  # the drift goes unseen
