"""Noise of channels: repeats pooled by degrees of freedom, single trials by their roughness."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.comparison.noise_floor import FloorRoute, noise_floor
from pamsim.inference.noise_model import NoiseModel, pooled_deviation, repeat_scatter
from pamsim.inference.residual_block import ResidualBlock, layout


def blocks(*trials):
    """Blocks of (protocol, residual) each, channel angle."""
    return [
        ResidualBlock(trial=f"t{i}", protocol=protocol, channel="angle", residual=residual)
        for i, (protocol, residual) in enumerate(trials)
    ]


def stack(given):
    return layout(given), np.concatenate([b.residual for b in given])


def test_repeats_scatter_about_their_mean_cut_to_the_shortest():
    rng = np.random.default_rng(0)
    long, short = rng.standard_normal(50), rng.standard_normal(30)
    places, residual = stack(blocks(("a", long + 7.0), ("a", short + 7.0), ("b", long)))
    scatter = repeat_scatter(places, residual)
    assert set(scatter) == {("angle", "a")}
    part = scatter["angle", "a"]
    assert part.freedom == 30
    assert part.square == pytest.approx(0.5 * np.sum((long[:30] - short) ** 2))
    assert part.variance == pytest.approx(np.mean(np.var([long[:30], short], axis=0, ddof=1)))


def test_calibrate_and_diagnose_take_the_same_noise_from_the_same_repeats():
    rng = np.random.default_rng(1)
    wave = 3.0 * np.sin(np.arange(400) / 9.0)  # what the simulator misses
    trials = [("a", wave + 0.1 * rng.standard_normal(400)) for _ in range(3)]
    trials += [("b", wave[:60] + 0.4 * rng.standard_normal(60)) for _ in range(2)]
    places, residual = stack(blocks(*trials))
    fitted = NoiseModel(places, residual).estimate(residual)["angle"]
    floor = noise_floor(places, residual)
    assert floor.sd["angle"] == pytest.approx(fitted, rel=1e-12)
    parts = list(repeat_scatter(places, residual).values())
    assert fitted == pytest.approx(pooled_deviation(parts), rel=1e-12)
    # 800 degrees of freedom of the one protocol against 60 of the other.
    assert fitted == pytest.approx(np.sqrt((800 * 0.01 + 60 * 0.16) / 860), rel=0.1)
    assert floor.variance["angle", "b"] == pytest.approx(0.16, rel=0.5)


def test_single_trials_count_model_error_in_a_fit_and_not_in_the_floor():
    rng = np.random.default_rng(2)
    wave = 3.0 * np.sin(np.arange(400) / 40.0)
    places, residual = stack(blocks(("a", wave + 0.1 * rng.standard_normal(400))))
    assert NoiseModel(places, residual).estimate(residual)["angle"] > 1.5
    floor = noise_floor(places, residual)
    assert floor.sd["angle"] == pytest.approx(0.1, rel=0.2)
    assert set(floor.routes.values()) == {FloorRoute.WITHIN_TRIALS}
