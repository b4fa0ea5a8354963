"""Whether one model predicts rows better than another, and the floor that recordings have."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from pamsim.comparison.noise_floor import noise_floor
from pamsim.diagnosis.method.evidence import compare_rows, share_of_rows
from pamsim.inference.residual_block import ResidualBlock, layout


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


def test_the_share_of_rows_is_that_of_their_mean_squares():
    rng = np.random.default_rng(14)
    before, after = rng.standard_normal(60), 0.5 * rng.standard_normal(60)
    share = share_of_rows(before, after)
    assert share.value == pytest.approx(1.0 - np.mean(after**2) / np.mean(before**2))
    low, high = share.interval95
    assert low < 0.75 < high
    assert share_of_rows(after, before).value == 0.0


def test_rows_are_compared_by_their_squared_errors():
    rng = np.random.default_rng(18)
    before, after = rng.standard_normal(40), 0.8 * rng.standard_normal(40)
    found = compare_rows(before, after)
    peer = stats.ttest_rel(before**2, after**2)
    assert found.gain == pytest.approx(np.mean(before**2) - np.mean(after**2))
    assert found.standard_errors == pytest.approx(peer.statistic)
    assert found.degrees == peer.df
    order = rng.permutation(40)
    assert compare_rows(before[order], after[order]).p_value == found.p_value
    assert compare_rows(before[:1], after[:1]).error == np.inf


def test_rows_in_which_neither_is_better_have_uniform_p_values():
    runs = 300
    p = np.array([
        compare_rows(*np.random.default_rng([19, run]).standard_normal((2, 12))).p_value
        for run in range(runs)
    ])  # fmt: skip
    for level in (0.05, 0.25, 0.5):
        error = np.sqrt(level * (1.0 - level) / runs)
        assert np.mean(p <= level) == pytest.approx(level, abs=3.0 * error)
