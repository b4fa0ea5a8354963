"""Noise of each channel: given, from repeats of a protocol, or from what a fit leaves.

Repeats have the same simulation, so their residuals differ by sensor noise and by what varies from
trial to trial, whatever the simulator misses: `repeat_scatter`, pooled by degrees of freedom.
Without repeats a fit weighs a channel by the root mean square of its residual (`NoiseModel`), model
error included; a judgement of the model itself must not, and takes the sample-to-sample roughness
(`pamsim.comparison.noise_floor`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.inference.simulator_fit import BlockPlace, NoiseSource
from pamsim.inference.trial_noise import same_rates

_EXACT = 1e-6  # of the first residual; below, a channel is matched and its weight stops growing
_SMALLEST = 1e-12  # [SI unit of the channel], for a channel that is exact from the start


@dataclass(frozen=True)
class Scatter:
    """Squared differences of repeats from their mean."""

    square: float  # their sum [SI unit of the channel, squared]
    freedom: int  # degrees of freedom

    @property
    def variance(self) -> float:
        """Unbiased variance [SI unit of the channel, squared]."""
        return self.square / self.freedom


def pooled_deviation(scatter: Sequence[Scatter]) -> float:
    """Standard deviation over several protocols [SI unit of the channel]."""
    square = sum(part.square for part in scatter)
    return float(np.sqrt(square / sum(part.freedom for part in scatter)))


def repeat_scatter(
    places: Sequence[BlockPlace], residual: FloatArray
) -> dict[tuple[str, str], Scatter]:
    """How far the repeats of each protocol with one clock scatter, cut to the shortest of them.

    The scatter is that of a residual (n,) [SI], by channel and protocol, for protocols with two
    such trials or more.
    """
    groups: dict[tuple[str, str], list[BlockPlace]] = {}
    for place in places:
        groups.setdefault((place.block.channel, place.block.protocol), []).append(place)
    scatter: dict[tuple[str, str], Scatter] = {}
    for key, group in groups.items():
        for same in same_rates([place.block.sample_interval or 0.0 for place in group]):
            trials = [residual[group[k].rows] for k in same]
            if len(trials) > 1:
                runs = np.stack([trial[: min(map(len, trials))] for trial in trials])
                square = float(np.sum((runs - runs.mean(axis=0)) ** 2))
                other = scatter.get(key, Scatter(0.0, 0))
                freedom = (runs.shape[0] - 1) * runs.shape[1]
                scatter[key] = Scatter(other.square + square, other.freedom + freedom)
    return scatter


class NoiseModel:
    """Noise of the channels of one set of blocks, re-estimated as a fit improves.

    Blocks that state their noise keep it. Otherwise the scatter between repeats of a protocol
    counts, in which what the simulator misses cancels; without repeats it is the root mean square
    of the residual (the concentrated likelihood). The size of the signal never enters. ``first``
    (n,) is the residual at the first start.
    """

    def __init__(self, places: Sequence[BlockPlace], first: FloatArray) -> None:
        self._places = tuple(places)
        self._channels: dict[str, list[BlockPlace]] = {}
        for place in places:
            self._channels.setdefault(place.block.channel, []).append(place)
        self._floor = {
            channel: max(_EXACT * rms(first, own), _SMALLEST)
            for channel, own in self._channels.items()
        }
        self._estimated = [p for p in places if p.block.noise_sd is None]
        self._repeated = {channel for channel, _ in repeat_scatter(self._estimated, first)}

    @property
    def channels(self) -> Mapping[str, Sequence[BlockPlace]]:
        """Channel -> its blocks."""
        return self._channels

    def source(self, channel: str) -> NoiseSource:
        """Where the noise of a channel comes from."""
        if all(place.block.noise_sd is not None for place in self._channels[channel]):
            return NoiseSource.GIVEN
        return NoiseSource.REPEATS if channel in self._repeated else NoiseSource.RESIDUAL

    @property
    def fixed(self) -> bool:
        """True if no channel is estimated."""
        return not self._estimated

    def estimate(self, residual: FloatArray) -> dict[str, float]:
        """Channel -> standard deviation [SI unit of the channel], by a residual (n,)."""
        scatter = repeat_scatter(self._estimated, residual)
        noise: dict[str, float] = {}
        for channel, own in self._channels.items():
            repeats = [s for (name, _), s in scatter.items() if name == channel]
            estimated = [p for p in own if p.block.noise_sd is None]
            if not estimated:
                sizes = [p.block.residual.size for p in own]
                given = np.square([p.block.noise_sd or 0.0 for p in own])
                noise[channel] = float(np.sqrt(np.average(given, weights=sizes)))
                continue
            found = pooled_deviation(repeats) if repeats else rms(residual, estimated)
            noise[channel] = max(found, self._floor[channel])
        return noise

    def deviation(self, noise: Mapping[str, float]) -> FloatArray:
        """Standard deviation of every row, shape (n,) [SI units of the channels]."""
        return np.concatenate(
            [
                np.full(block.residual.size, block.noise_sd or noise[block.channel])
                for block in (place.block for place in self._places)
            ]
        )


def rms(residual: FloatArray, places: Sequence[BlockPlace]) -> float:
    """Root mean square of a residual (n,) over some blocks [SI unit of their channel]."""
    chosen = np.concatenate([residual[place.rows] for place in places])
    return float(np.sqrt(np.mean(chosen**2)))
