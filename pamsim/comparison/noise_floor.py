"""Noise floor: how far a perfect model would still be off, from repeats where there are any."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pamsim.comparison.trial_residuals import TrialLayout
from pamsim.inference.noise_model import Scatter, pooled_deviation, repeat_scatter
from pamsim.signals.roughness import rough_noise

FloatArray = NDArray[np.float64]

FEWEST_REPEATS = 3
"""With fewer repeats of a protocol its floor is an assumption."""


@dataclass(frozen=True, kw_only=True)
class NoiseFloor:
    """Noise of every channel.

    Attributes:
        sd: channel -> standard deviation over all protocols [SI].
        variance: (channel, protocol) -> variance [SI^2].
        repeats: smallest number of repeats of a protocol.
        assumed: True if there are too few repeats: noise then counts as white, and what drifts from
            trial to trial counts as model error.
    """

    sd: Mapping[str, float]
    variance: Mapping[tuple[str, str], float]
    repeats: int
    assumed: bool

    def variance_in(self, channel: str, protocol: str) -> float:
        """Variance of a channel in a protocol [SI^2]; over all of them if it is not known there."""
        return self.variance.get((channel, protocol), self.sd[channel] ** 2)


def noise_floor(layout: TrialLayout, residual: FloatArray) -> NoiseFloor:
    """Noise from what repeats of a protocol differ by.

    Whatever the model is, repeats have the same simulation, so their residuals differ by sensor
    noise and by what varies from trial to trial.

    Args:
        layout: of the residual.
        residual: (n,) of any parameters [SI].
    """
    trials: dict[tuple[str, str], list[FloatArray]] = {}
    for place in layout.places:
        key = (place.block.channel, place.block.protocol)
        trials.setdefault(key, []).append(residual[place.rows])
    scatter = repeat_scatter(layout.places, residual)
    for key, (first, *_) in trials.items():
        if key not in scatter:
            scatter[key] = Scatter(rough_noise(first) ** 2 * first.size, first.size)
    repeats = min(map(len, trials.values()))
    return NoiseFloor(
        sd={
            channel: max(
                pooled_deviation([s for (name, _), s in scatter.items() if name == channel]),
                _smallest(layout, channel),
            )
            for channel in layout.channels
        },
        variance={key: scatter[key].variance for key in trials},
        repeats=repeats,
        assumed=repeats < FEWEST_REPEATS,
    )


def _smallest(layout: TrialLayout, channel: str) -> float:
    """A noise below rounding would let the last bit of a simulation decide [SI]."""
    size = max(
        float(np.abs(p.block.residual).max()) for p in layout.places if p.block.channel == channel
    )
    return max(1e-9 * size, np.finfo(float).tiny)
