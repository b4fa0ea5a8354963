"""Where a model misses: which channel, in which protocol, and in which region of the motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from pamsim.comparison.noise_floor import NoiseFloor
from pamsim.comparison.trial_residuals import TrialLayout

FloatArray = NDArray[np.float64]
Regressors = Mapping[str, Mapping[str, FloatArray]]
"""Trial -> name of a quantity -> its values at the trial's samples."""

_BINS = 8
_FLIPS = 999
_FEWEST = 5  # samples of a trial in a bin


@dataclass(frozen=True, kw_only=True)
class Cell:
    """One channel in one protocol.

    Attributes:
        channel: such as ``angle``.
        protocol: such as ``triangle``.
        excess: mean square residual over the floor, minus 1.
        p_value: one-sided, of no excess over the trials; 1 without repeats.
    """

    channel: str
    protocol: str
    excess: float
    p_value: float


@dataclass(frozen=True, kw_only=True)
class Map:
    """A channel's mean residual over bins of one quantity.

    Attributes:
        channel: such as ``angle``.
        quantity: such as ``pressure``.
        edges: of the bins [SI], (b + 1,).
        mean: (b,) of the residual in each bin, measured minus simulated, in units of noise; NaN for
            an empty one.
        p_value: of no mean in any bin: one for the whole map, by flipping the signs of trials.
    """

    channel: str
    quantity: str
    edges: FloatArray
    mean: FloatArray
    p_value: float

    @property
    def region(self) -> tuple[float, float]:
        """Ends of the bin that is off most [SI]."""
        worst = int(np.nanargmax(np.abs(self.mean)))
        return float(self.edges[worst]), float(self.edges[worst + 1])


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
    found: list[Cell] = []
    for (channel, protocol), values in squares.items():
        variance = floor.variance.get((channel, protocol), floor.sd[channel] ** 2)
        ratio = np.array(values) / max(variance, np.finfo(float).tiny) - 1.0
        excess, p_value = float(np.mean(ratio)), 1.0
        if ratio.size > 1:
            error = float(np.std(ratio, ddof=1)) / np.sqrt(ratio.size)
            p_value = float(student.sf(excess / error, ratio.size - 1)) if error else 0.0
        found.append(Cell(channel=channel, protocol=protocol, excess=excess, p_value=p_value))
    return tuple(sorted(found, key=lambda cell: -cell.excess))


def maps(
    layout: TrialLayout,
    residual: FloatArray,
    floor: NoiseFloor,
    regressors: Regressors,
    *,
    seed: int = 0,
) -> tuple[Map, ...]:
    """Mean residual over bins of every quantity, for every channel, the surest first.

    Args:
        layout: of the residual.
        residual: (n,) simulated minus measured [SI].
        floor: of the noise.
        regressors: quantities at the samples of the trials that count.
        seed: of the sign flips.
    """
    rng = np.random.default_rng(seed)
    found: list[Map] = []
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
                found.append(_map(channel, quantity, edges, means, rng))
    return tuple(sorted(found, key=lambda m: (m.p_value, -np.nanmax(np.abs(m.mean)))))


def _edges(values: FloatArray) -> FloatArray:
    """Bins of about equal counts; fewer where values repeat."""
    return np.unique(np.quantile(values[np.isfinite(values)], np.linspace(0.0, 1.0, _BINS + 1)))


def _binned(values: FloatArray, residual: FloatArray, edges: FloatArray) -> FloatArray:
    """Mean residual in each bin, NaN where a trial has too few samples."""
    number = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, edges.size - 2)
    counts = np.bincount(number, minlength=edges.size - 1)
    sums = np.bincount(number, weights=residual, minlength=edges.size - 1)
    return np.where(counts >= _FEWEST, sums / np.maximum(counts, 1), np.nan)


def _map(
    channel: str, quantity: str, edges: FloatArray, means: FloatArray, rng: np.random.Generator
) -> Map:
    """Judge a map by its largest standardised bin, against the same with trials' signs flipped."""
    known = np.isfinite(means)
    filled, count = np.where(known, means, 0.0), known.sum(axis=0)

    def largest(signs: FloatArray) -> FloatArray:
        total = np.abs(signs @ filled)
        spread = np.sqrt(np.maximum((filled**2).sum(axis=0), np.finfo(float).tiny))
        return np.max(np.where(count > 1, total / spread, 0.0), axis=1)

    signs = rng.choice([-1.0, 1.0], (_FLIPS, means.shape[0]))
    observed = float(largest(np.ones((1, means.shape[0])))[0])
    beyond = int(np.sum(largest(signs) >= observed * (1.0 - 1e-12)))
    mean = np.where(count > 0, filled.sum(axis=0) / np.maximum(count, 1), np.nan)
    return Map(
        channel=channel,
        quantity=quantity,
        edges=edges,
        mean=mean,
        p_value=(1 + beyond) / (1 + _FLIPS),
    )
