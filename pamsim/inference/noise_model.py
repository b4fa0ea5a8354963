"""Standard deviation of each channel's noise: given, from repeats, or from what a fit leaves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from pamsim.inference.residual_block import BlockPlace
from pamsim.inference.simulator_fit import NoiseSource

FloatArray = NDArray[np.float64]

_EXACT = (
    1e-6  # of the first residual: below this a channel is matched exactly, weights stop growing
)
_SMALLEST = 1e-12  # [SI unit of the channel], for a channel that is exact from the start


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
        self._repeats: dict[str, list[list[slice]]] = {}
        groups: dict[tuple[str, str, int], list[slice]] = {}
        for place in self._places:
            if place.block.noise_sd is None:
                key = place.block.channel, place.block.protocol, place.block.residual.size
                groups.setdefault(key, []).append(place.rows)
        for (channel, _, _), rows in groups.items():
            if len(rows) > 1:
                self._repeats.setdefault(channel, []).append(rows)

    def source(self, channel: str) -> NoiseSource:
        """Where the noise of a channel comes from."""
        blocks = [p.block for p in self._places if p.block.channel == channel]
        if all(block.noise_sd is not None for block in blocks):
            return NoiseSource.GIVEN
        return NoiseSource.REPEATS if channel in self._repeats else NoiseSource.RESIDUAL

    @property
    def fixed(self) -> bool:
        """True if no channel is estimated."""
        return all(place.block.noise_sd is not None for place in self._places)

    def estimate(self, residual: FloatArray) -> dict[str, float]:
        """Estimate the noise of each channel.

        Args:
            residual: shape (n,) [SI units of the channels].

        Returns:
            Channel -> standard deviation [SI unit of the channel].
        """
        found: dict[str, float] = {}
        for channel in self._floor:
            own = [p for p in self._places if p.block.channel == channel]
            free = [p.rows for p in own if p.block.noise_sd is None]
            if not free:
                given = [p.block.noise_sd or 0.0 for p in own for _ in range(p.block.residual.size)]
                found[channel] = float(np.sqrt(np.mean(np.square(given))))
            elif channel in self._repeats:
                square, freedom = 0.0, 0
                for rows in self._repeats[channel]:
                    runs = np.stack([residual[r] for r in rows])
                    square += float(np.sum((runs - runs.mean(axis=0)) ** 2))
                    freedom += (runs.shape[0] - 1) * runs.shape[1]
                found[channel] = max(float(np.sqrt(square / freedom)), self._floor[channel])
            else:
                found[channel] = max(_rms(residual, free), self._floor[channel])
        return found

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
