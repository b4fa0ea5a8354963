"""How far a perfect model would still be off: the noise floor, from repeats where there are any."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pamsim.comparison.trial_residuals import TrialLayout
from pamsim.signals.roughness import rough_noise

FloatArray = NDArray[np.float64]

FEWEST_REPEATS = 3
"""Fewer repeats of a protocol than this, and its floor is a guess."""


@dataclass(frozen=True, kw_only=True)
class NoiseFloor:
    """Noise of every channel.

    Attributes:
        sd: channel -> standard deviation over all protocols [SI].
        variance: (channel, protocol) -> variance [SI^2].
        repeats: smallest number of repeats of a protocol.
        assumed: True if it could not be had from repeats: noise then counts as white, and what
            drifts from trial to trial counts as the model's fault.
    """

    sd: Mapping[str, float]
    variance: Mapping[tuple[str, str], float]
    repeats: int
    assumed: bool


def noise_floor(layout: TrialLayout, residual: FloatArray) -> NoiseFloor:
    """Noise from what repeats of a protocol differ by.

    Whatever the model is, repeats have the same simulation, so their residuals differ by sensor
    noise and by what varies from trial to trial.

    Args:
        layout: of the residual.
        residual: (n,) of any parameters [SI].
    """
    groups: dict[tuple[str, str], list[FloatArray]] = {}
    for place in layout.places:
        key = (place.block.channel, place.block.protocol)
        groups.setdefault(key, []).append(residual[place.rows])
    repeats = min(len(members) for members in groups.values())
    variance: dict[tuple[str, str], float] = {}
    assumed = False
    for key, members in groups.items():
        shortest = min(map(len, members))
        if len(members) > 1:
            stack = np.stack([member[:shortest] for member in members])
            variance[key] = float(np.mean(np.var(stack, axis=0, ddof=1)))
        else:
            assumed = True
            variance[key] = rough_noise(members[0]) ** 2
    least = {c: _smallest(layout, c) for c in layout.channels}
    pooled = {
        channel: max(
            float(np.sqrt(np.mean([v for (c, _), v in variance.items() if c == channel]))),
            least[channel],
        )
        for channel in layout.channels
    }
    return NoiseFloor(
        sd=pooled,
        variance=variance,
        repeats=repeats,
        assumed=assumed or repeats < FEWEST_REPEATS,
    )


def _smallest(layout: TrialLayout, channel: str) -> float:
    """A noise below rounding would let the last bit of a simulation decide [SI]."""
    size = max(
        float(np.abs(p.block.residual).max()) for p in layout.places if p.block.channel == channel
    )
    return max(1e-9 * size, np.finfo(float).tiny)
