"""Residual blocks: rows of a residual, the unit they are held out with, and their noise.

Trials, tables at rest and loops are the same kind of data: rows of one channel whose noise is known
up to independence, in units that are fitted or held out as a whole and that are exchanged by a
test.

* Recordings: a unit is a trial, or a part of a trial.
* Tables at rest: a unit is a row.
* Loops: a unit is a level of the input, with its readings on all branches.

Units must be independent of each other. Neighbouring parts of one log are so only if a gap as long
as the noise's correlation separates them (`correlation_length`, `cut`, `fitted_runs`), and if
nothing varies from log to log: all parts of one log share such a variation. Its directions belong
into the noise that the rows of a log share.

Whitened rows have independent noise of variance 1, so that their sum of squares is -2 log
likelihood up to a constant, however densely a channel is sampled.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import scipy.linalg

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.inference.coloured_noise import ArNoise, fit_ar_noise


@dataclass(frozen=True, kw_only=True)
class Block:
    """Rows of one channel in one unit."""

    # Name of what is held out or exchanged as a whole; all channels of a trial, or of a part of
    # one, share it
    unit: str
    channel: str  # such as ``angle``
    rows: slice  # where they are in the residual of a simulation, with start and stop
    noise: ArNoise  # of the rows; white noise is ``ArNoise((), variance)``
    source: str = ""  # name of the log or table that they come from

    def __post_init__(self) -> None:
        """Check rows and noise.

        Raises:
            InputError: no rows, or a noise that is not positive and finite.
        """
        where = f"unit {self.unit}, channel {self.channel}"
        if self.size < 1:
            raise InputError(f"{where}: no rows ({self.rows.start} to {self.rows.stop})")
        if not (np.isfinite(self.noise.variance) and self.noise.variance > 0.0):
            raise InputError(f"{where}: noise variance {self.noise.variance:g} is not positive")

    @property
    def size(self) -> int:
        """Number of rows."""
        return self.rows.stop - self.rows.start

    def part(self, unit: str, start: int, stop: int) -> Block:
        """Rows ``start`` to ``stop`` of the block, counted from its first, as a unit."""
        rows = slice(self.rows.start + start, self.rows.start + stop)
        return replace(self, unit=unit, rows=rows)

    def white(self, own: FloatArray) -> FloatArray:
        """Own rows of a residual or a Jacobian, (n, ...), with white noise of variance 1."""
        return self.noise.whiten(own) / np.sqrt(self.noise.variance)


def unit_names(blocks: Sequence[Block]) -> tuple[str, ...]:
    """Names of the units, in the order of their first block."""
    return tuple(dict.fromkeys(block.unit for block in blocks))


def whitened(blocks: Sequence[Block], values: FloatArray) -> FloatArray:
    """Whitened rows of all blocks in their order, of values (N,) or (N, k) as simulated [SI]."""
    # Blocks of one length and noise are filtered as columns of one array.
    same: dict[tuple[int, int], list[int]] = {}
    for k, block in enumerate(blocks):
        same.setdefault((id(block.noise), block.size), []).append(k)
    found: dict[int, FloatArray] = {}
    for numbers in same.values():
        own = np.stack([values[blocks[k].rows] for k in numbers], axis=1)
        white = blocks[numbers[0]].white(own.reshape(len(own), -1)).reshape(own.shape)
        found |= {k: white[:, i] for i, k in enumerate(numbers)}
    return np.concatenate([found[k] for k in range(len(blocks))])


def noise_from_repeats(protocols: Sequence[FloatArray]) -> ArNoise:
    """Noise of a channel by what repeats of a protocol differ by, whatever the model misses.

    For each protocol a residual per repeat is given, (r, n) with r >= 2 [SI unit of the channel].

    Raises:
        InputError: no protocol was repeated.
    """
    # Helmert's contrasts: r - 1 independent series with the noise of the r repeats.
    contrasts = [
        c for runs in protocols if len(runs) > 1 for c in scipy.linalg.helmert(len(runs)) @ runs
    ]
    if not contrasts:
        raise InputError(
            "no protocol was repeated, so the noise is not known; record one twice or more"
        )
    return fit_ar_noise(contrasts)


def correlation_length(noise: ArNoise, samples: int) -> int:
    """Rows over which noise is correlated: the gap between parts that may count as independent.

    It is the last lag at which the autocorrelation is at least ``1 / sqrt(samples)``, the standard
    error of the autocorrelation of white noise: what is below cannot be distinguished from 0.

    Source: M. S. Bartlett, Supplement to the Journal of the Royal Statistical Society 8 (1946).
    """
    lags = noise.autocovariance(samples)
    return int(np.flatnonzero(np.abs(lags) * np.sqrt(samples) >= lags[0])[-1])


def most_parts(size: int, gap: int) -> int:
    """Most parts of a series of ``size`` rows with ``gap`` rows between them.

    Each is at least as long as the gap, one independent piece of evidence.
    """
    return size if gap == 0 else max((size + gap) // (2 * gap), 1)


def cut(block: Block, parts: int, gap: int) -> tuple[Block, ...]:
    """Cut a series into units with gaps of some rows between them, which belong to none.

    Channels of one log cut into as many parts, with gaps as long in time, share their units: the
    gap is that of the channel with the longest correlation.

    Raises:
        InputError: parts that would be shorter than the gap.
    """
    if not 1 <= parts <= most_parts(block.size, gap):
        raise InputError(
            f"unit {block.unit}: {block.size} rows do not give {parts} parts with gaps of {gap}"
            f" rows; at most {most_parts(block.size, gap)}"
        )
    ends = np.linspace(-gap, block.size, parts + 1).round().astype(int).tolist()
    return tuple(
        block.part(f"{block.unit} part {number}", start + gap, stop)
        for number, (start, stop) in enumerate(pairwise(ends), 1)
    )


def fitted_runs(block: Block, held_out: Sequence[Block], gap: int) -> tuple[Block, ...]:
    """Runs of a series that may be fitted: ``gap`` rows away from every held-out part."""
    free = np.ones(block.size + 2, dtype=bool)  # with a row before and one behind, to find ends
    free[[0, -1]] = False
    for part in held_out:
        start, stop = part.rows.start - block.rows.start, part.rows.stop - block.rows.start
        free[max(start - gap + 1, 0) : stop + gap + 1] = False
    ends = np.flatnonzero(np.diff(free)).tolist()
    return tuple(
        block.part(f"{block.unit} fitted {number}", start, stop)
        for number, (start, stop) in enumerate(zip(ends[::2], ends[1::2], strict=True), 1)
    )
