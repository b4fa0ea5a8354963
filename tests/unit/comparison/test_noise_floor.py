"""The floor that recordings have."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.comparison.noise_floor import noise_floor
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
