"""Where a model misses: which channel, in which protocol, and over which quantity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from pamsim.comparison.noise_floor import NoiseFloor
from pamsim.comparison.trial_residuals import TrialLayout
from pamsim.core.units import FloatArray
from pamsim.diagnosis.method.verdict_thresholds import SIGNIFICANCE
from pamsim.inference.permutation import exchange_p_value, sign_flip_p_value

Regressors = Mapping[str, Mapping[str, FloatArray]]
"""Trial -> name of a quantity -> its values at the trial's samples."""

_BINS = 8
_FLIPS = 999
_FEWEST_SAMPLES = 5  # of a trial in a bin

_MOST_ROW_BINS = 4
_FEWEST_ROWS = 3  # in a bin
_EXCHANGES = 4_999


@dataclass(frozen=True, kw_only=True)
class Cell:
    """One channel in one protocol.

    Attributes:
        channel: such as ``angle``.
        protocol: such as ``triangle``.
        excess: mean square residual over the noise variance, minus 1.
        p_value: one-sided, of no excess over the trials; 1 without repeats.
    """

    channel: str
    protocol: str
    excess: float
    p_value: float


@dataclass(frozen=True, kw_only=True)
class ResidualMap:
    """A channel's mean residual over bins of one quantity.

    Attributes:
        channel: such as ``angle``.
        quantity: such as ``common_pressure``.
        edges: of the bins [SI], (b + 1,); of rows the lowest in each bin, and the highest of all.
        mean: (b,) of the residual in each bin, measured minus simulated: of trials in units of
            noise, NaN for an empty bin; of rows [SI].
        p_value: that the residual does not depend on the quantity: one for the whole map, by sign
            flips of trials or by exchanging rows.
        worst: number of the bin that is off most; of bins as far off, that of the largest mean.
        rows: names of the rows in each bin; empty for trials.
        rms: (b,) root mean square of the residual of rows [SI]; None for trials.
    """

    channel: str
    quantity: str
    edges: FloatArray
    mean: FloatArray
    p_value: float
    worst: int
    rows: tuple[tuple[str, ...], ...] = ()
    rms: FloatArray | None = None

    @property
    def region(self) -> tuple[float, float]:
        """Ends of the bin that is off most [SI]."""
        return float(self.edges[self.worst]), float(self.edges[self.worst + 1])


def cells(
    layout: TrialLayout, residual: FloatArray, floor: NoiseFloor, trials: Sequence[str]
) -> tuple[Cell, ...]:
    """Excess over the noise floor of every channel in every protocol, the largest first.

    Args:
        layout: of the residual.
        residual: (n,) [SI].
        floor: of the noise.
        trials: that count.
    """
    squares: dict[tuple[str, str], list[float]] = {}
    wanted = set(trials)
    for place in layout.places:
        block = place.block
        if block.trial in wanted:
            mean = float(np.mean(residual[place.rows] ** 2))
            squares.setdefault((block.channel, block.protocol), []).append(mean)
    table: list[Cell] = []
    for (channel, protocol), values in squares.items():
        variance = max(floor.variance_in(channel, protocol), np.finfo(float).tiny)
        ratio = np.array(values) / variance - 1.0
        excess, p_value = float(np.mean(ratio)), 1.0
        if ratio.size > 1:
            error = float(np.std(ratio, ddof=1)) / np.sqrt(ratio.size)
            p_value = float(student.sf(excess / error, ratio.size - 1)) if error else 0.0
        table.append(Cell(channel=channel, protocol=protocol, excess=excess, p_value=p_value))
    return tuple(sorted(table, key=lambda cell: -cell.excess))


def trial_maps(
    layout: TrialLayout,
    residual: FloatArray,
    floor: NoiseFloor,
    regressors: Regressors,
    *,
    seed: int = 0,
) -> tuple[ResidualMap, ...]:
    """Map the residual of every channel over every quantity, the most significant map first.

    Args:
        layout: of the residual.
        residual: (n,) simulated minus measured [SI].
        floor: of the noise.
        regressors: quantities at the samples of the trials that count, free of the noise of the
            residual: over the measured signal itself, noise would depend on it.
        seed: random seed of the sign flips.
    """
    rng = np.random.default_rng(seed)
    maps: list[ResidualMap] = []
    for channel in layout.channels:
        parts = [
            (p.block.trial, -residual[p.rows] / floor.sd[channel])
            for p in layout.places
            if p.block.channel == channel and p.block.trial in regressors
        ]
        quantities = dict.fromkeys(name for trial, _ in parts for name in regressors[trial])
        for quantity in quantities:
            pairs = [(regressors[t][quantity], r) for t, r in parts if quantity in regressors[t]]
            edges = _edges(np.concatenate([values for values, _ in pairs]))
            if edges.size > 2:
                means = np.stack([_binned(values, r, edges) for values, r in pairs])
                maps.append(_trial_map(channel, quantity, edges, means, rng))
    return tuple(sorted(maps, key=lambda m: (m.p_value, -np.nanmax(np.abs(m.mean)))))


def row_maps(
    misfit: FloatArray,
    quantities: Mapping[str, FloatArray],
    names: tuple[str, ...],
    *,
    channel: str,
    seed: int = 0,
) -> tuple[ResidualMap, ...]:
    """Map the misfit of a table's rows over every quantity, the most significant map first.

    Args:
        misfit: (n,) measured minus simulated [SI], with the sign in which it means something.
        quantities: name -> its values, (n,) [SI]; those that do not vary are skipped.
        names: of the rows.
        channel: what the table measures.
        seed: random seed of the exchanges.
    """
    maps: list[ResidualMap] = []
    for quantity, values in quantities.items():
        bins = _row_bins(values)
        if bins.max(initial=0) > 0:
            maps.append(_row_map(channel, quantity, values, misfit, bins, names, seed))
    return tuple(sorted(maps, key=lambda m: (m.p_value, -float(np.max(np.abs(m.mean))))))


def systematic(maps: Sequence[ResidualMap]) -> bool:
    """Whether a residual depends on one of its quantities, by the Bonferroni-corrected p-value.

    Without repeats this is the only test of a remainder that a table of rows allows.
    """
    return any(m.p_value * len(maps) < SIGNIFICANCE for m in maps)


def _edges(values: FloatArray) -> FloatArray:
    """Bins of about equal counts; fewer where values repeat."""
    return np.unique(np.quantile(values[np.isfinite(values)], np.linspace(0.0, 1.0, _BINS + 1)))


def _binned(values: FloatArray, residual: FloatArray, edges: FloatArray) -> FloatArray:
    """Mean residual in each bin, NaN where a trial has too few samples."""
    number = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, edges.size - 2)
    counts = np.bincount(number, minlength=edges.size - 1)
    sums = np.bincount(number, weights=residual, minlength=edges.size - 1)
    return np.where(counts >= _FEWEST_SAMPLES, sums / np.maximum(counts, 1), np.nan)


def _trial_map(
    channel: str, quantity: str, edges: FloatArray, means: FloatArray, rng: np.random.Generator
) -> ResidualMap:
    """Judge a map by its largest standardised bin, against the same with trials' signs flipped."""
    known = np.isfinite(means)
    filled, count = np.where(known, means, 0.0), known.sum(axis=0)

    def largest(signs: FloatArray) -> FloatArray:
        total = np.abs(signs @ filled)
        spread = np.sqrt(np.maximum((filled**2).sum(axis=0), np.finfo(float).tiny))
        return np.max(np.where(count > 1, total / spread, 0.0), axis=1)

    mean = np.where(count > 0, filled.sum(axis=0) / np.maximum(count, 1), np.nan)
    return ResidualMap(
        channel=channel,
        quantity=quantity,
        edges=edges,
        mean=mean,
        p_value=sign_flip_p_value(largest, means.shape[0], _FLIPS, rng),
        worst=int(np.nanargmax(np.abs(mean))),
    )


def _row_bins(values: FloatArray) -> NDArray[np.intp]:
    """Number of each row's bin: about equal counts, equal values together."""
    kinds, place, counts = np.unique(values, return_inverse=True, return_counts=True)
    wanted = max(min(_MOST_ROW_BINS, values.size // _FEWEST_ROWS), 1)
    number, inside = np.zeros(kinds.size, dtype=np.intp), 0
    for k in range(1, kinds.size):
        inside += int(counts[k - 1])
        left = int(counts[k:].sum())
        full = inside >= max(values.size / wanted - 0.5, _FEWEST_ROWS)
        number[k] = number[k - 1] + (1 if full and left >= _FEWEST_ROWS else 0)
        inside = 0 if number[k] > number[k - 1] else inside
    return number[place]


def _row_map(
    channel: str,
    quantity: str,
    values: FloatArray,
    misfit: FloatArray,
    bins: NDArray[np.intp],
    names: tuple[str, ...],
    seed: int,
) -> ResidualMap:
    """Judge a map by its largest standardised bin, against the same with rows exchanged."""
    count = int(bins.max()) + 1
    order = np.lexsort((misfit, values))  # not the order of the table, which means nothing
    member = np.zeros((misfit.size, count))
    member[np.arange(misfit.size), bins[order]] = 1.0
    many = member.sum(axis=0)
    off = (misfit - misfit.mean())[order]

    def standardised(rows: FloatArray) -> FloatArray:
        # Divided by the root of the count, a bin of a few rows needs a larger mean.
        return np.abs(rows @ member) / np.sqrt(many * (1.0 - many / misfit.size))

    lows = [float(values[bins == b].min()) for b in range(count)]
    mean = np.array([misfit[bins == b].mean() for b in range(count)])
    # Of two bins, the one is always as far off as the other: rounding must not choose.
    sizes = standardised(off[np.newaxis])[0]
    worst = np.where(sizes > (1.0 - 1e-9) * sizes.max(), np.abs(mean), -1.0).argmax()
    return ResidualMap(
        channel=channel,
        quantity=quantity,
        edges=np.array([*lows, float(values.max())]),
        mean=mean,
        p_value=exchange_p_value(
            lambda rows: standardised(rows).max(axis=1),
            off,
            _EXCHANGES,
            np.random.default_rng(seed),
        ),
        worst=int(worst),
        rows=tuple(
            tuple(name for name, b in zip(names, bins, strict=True) if b == number)
            for number in range(count)
        ),
        rms=np.array([np.sqrt(np.mean(misfit[bins == b] ** 2)) for b in range(count)]),
    )
