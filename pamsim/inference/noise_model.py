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
from pamsim.inference.residual_block import BlockPlace
from pamsim.inference.simulator_fit import NoiseSource
from pamsim.inference.trial_noise import same_rates

_EXACT = 1e-6  # of the first residual; below, a channel is matched and its weight stops growing
_SMALLEST = 1e-12  # [SI unit of the channel], for a channel that is exact from the start


@dataclass(frozen=True)
class Scatter:
    """Squared differences of repeats from their mean.

    Attributes:
        square: their sum [SI unit of the channel, squared].
        freedom: degrees of freedom.
    """

    square: float
    freedom: int

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

    Args:
        places: blocks of all trials.
        residual: shape (n,) [SI units of the channels].

    Returns:
        (channel, protocol) -> scatter, for protocols with two such trials or more.
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
    of the residual (the concentrated likelihood). The size of the signal never enters.

    Args:
        places: the blocks.
        first: their residual at the first start, shape (n,).
    """

    def __init__(self, places: Sequence[BlockPlace], first: FloatArray) -> None:
        self._places = tuple(places)
        self._floor = {
            channel: max(_EXACT * _rms(first, rows), _SMALLEST)
            for channel, rows in _rows(self._places).items()
        }
        self._estimated = tuple(p for p in self._places if p.block.noise_sd is None)
        self._repeated = {channel for channel, _ in repeat_scatter(self._estimated, first)}

    def source(self, channel: str) -> NoiseSource:
        """Where the noise of a channel comes from."""
        blocks = [p.block for p in self._places if p.block.channel == channel]
        if all(block.noise_sd is not None for block in blocks):
            return NoiseSource.GIVEN
        return NoiseSource.REPEATS if channel in self._repeated else NoiseSource.RESIDUAL

    @property
    def fixed(self) -> bool:
        """True if no channel is estimated."""
        return all(place.block.noise_sd is not None for place in self._places)

    def estimate(self, residual: FloatArray) -> dict[str, float]:
        """Channel -> standard deviation [SI unit of the channel], by a residual (n,)."""
        scatter = repeat_scatter(self._estimated, residual)
        noise: dict[str, float] = {}
        for channel, smallest in self._floor.items():
            own = [p for p in self._places if p.block.channel == channel]
            repeats = [s for (name, _), s in scatter.items() if name == channel]
            estimated = [p.rows for p in own if p.block.noise_sd is None]
            if not estimated:
                given = [p.block.noise_sd or 0.0 for p in own for _ in range(p.block.residual.size)]
                noise[channel] = float(np.sqrt(np.mean(np.square(given))))
            elif repeats:
                noise[channel] = max(pooled_deviation(repeats), smallest)
            else:
                noise[channel] = max(_rms(residual, estimated), smallest)
        return noise

    def deviation(self, noise: Mapping[str, float]) -> FloatArray:
        """Standard deviation of every row, shape (n,) [SI units of the channels]."""
        return np.concatenate(
            [
                np.full(
                    place.block.residual.size, place.block.noise_sd or noise[place.block.channel]
                )
                for place in self._places
            ]
        )


def _rows(places: Sequence[BlockPlace]) -> dict[str, list[slice]]:
    rows: dict[str, list[slice]] = {}
    for place in places:
        rows.setdefault(place.block.channel, []).append(place.rows)
    return rows


def _rms(residual: FloatArray, rows: Sequence[slice]) -> float:
    chosen = np.concatenate([residual[r] for r in rows])
    return float(np.sqrt(np.mean(chosen**2)))
