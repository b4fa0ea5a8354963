"""Noise floor: how far a perfect model would still be off, from repeats or within trials."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.comparison.noise_within_trial import FloorRoute, noise_within_trial
from pamsim.core.units import FloatArray
from pamsim.inference.noise_model import pooled_deviation, repeat_scatter
from pamsim.inference.residual_block import BlockPlace
from pamsim.recordings.trial import Trial


@dataclass(frozen=True, kw_only=True)
class NoiseFloor:
    """Noise of every channel.

    Attributes:
        sd: channel -> standard deviation over all protocols [SI].
        variance: (channel, protocol) -> variance [SI^2].
        routes: (channel, protocol) -> how it is known.
    """

    sd: Mapping[str, float]
    variance: Mapping[tuple[str, str], float]
    routes: Mapping[tuple[str, str], FloorRoute]

    def variance_in(self, channel: str, protocol: str) -> float:
        """Variance of a channel in a protocol [SI^2]; over all of them if it is not known there."""
        return self.variance.get((channel, protocol), self.sd[channel] ** 2)


def noise_floor(
    places: Sequence[BlockPlace],
    residual: FloatArray,
    trials: Sequence[Trial] = (),
) -> NoiseFloor:
    """Noise from what repeats of a protocol differ by, or else within trials.

    Whatever the model is, repeats have the same simulation, so their residuals differ by sensor
    noise and by what varies from trial to trial.

    Args:
        places: of the channels of all trials in the residual.
        residual: (n,) of any parameters [SI].
        trials: by whose commands, their periods and holds, single trials are judged, and whose
            stated noise is the least.
    """
    of_trial = {trial.name: trial for trial in trials}
    in_protocol: dict[tuple[str, str], list[BlockPlace]] = {}
    stated: dict[str, float] = {}
    for place in places:
        channel, trial = place.block.channel, of_trial.get(place.block.trial)
        in_protocol.setdefault((channel, place.block.protocol), []).append(place)
        if trial is not None and channel in trial.noise:
            stated[channel] = max(trial.noise[channel].rms, stated.get(channel, 0.0))
    scatter = repeat_scatter(places, residual)
    routes = dict.fromkeys(scatter, FloorRoute.REPEATS)
    for key, (first, *_) in in_protocol.items():
        if key not in scatter:
            own = of_trial.get(first.block.trial)
            routes[key], scatter[key] = noise_within_trial(
                residual[first.rows],
                first.block.sample_interval or 1.0,
                None if own is None else own.command,
            )
    return NoiseFloor(
        sd={
            channel: max(
                pooled_deviation([s for (name, _), s in scatter.items() if name == channel]),
                _smallest(places, channel),
                stated.get(channel, 0.0),
            )
            for channel in dict.fromkeys(place.block.channel for place in places)
        },
        variance={
            key: max(scatter[key].variance, stated.get(key[0], 0.0) ** 2) for key in in_protocol
        },
        routes=routes,
    )


def _smallest(places: Sequence[BlockPlace], channel: str) -> float:
    """A noise below rounding would let the last bit of a simulation decide [SI]."""
    size = max(float(np.abs(p.block.residual).max()) for p in places if p.block.channel == channel)
    return max(1e-9 * size, np.finfo(float).tiny)
