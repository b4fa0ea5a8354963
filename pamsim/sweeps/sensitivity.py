"""Which factors matter: rank correlations of any sweep, Sobol' indices of Saltelli's design."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.stats

from pamsim.core.units import FloatArray

_stats: Any = scipy.stats

_FEWEST = 4

_CONSTANT = 1e-4
"""Range of an output, relative to its largest value, below which it does not vary."""

_RESAMPLES = 500


@dataclass(frozen=True, kw_only=True)
class SobolIndex:
    """Share of an output's variance that a factor makes.

    Attributes:
        first: by itself.
        first_interval95: bootstrap interval.
        total: with all interactions.
        total_interval95: bootstrap interval.
    """

    first: float
    first_interval95: tuple[float, float]
    total: float
    total_interval95: tuple[float, float]


def rank_correlations(
    factors: Mapping[str, FloatArray], outputs: Mapping[str, FloatArray]
) -> dict[str, dict[str, float]]:
    """Spearman's correlation of each output with each factor.

    Args:
        factors: name -> (n,).
        outputs: name -> (n,), NaN where a run failed.

    Returns:
        Output -> factor -> correlation in [-1, 1], over the runs that have the output. Without
        outputs that do not vary, or that fewer than four runs have.
    """
    found: dict[str, dict[str, float]] = {}
    for output, values in outputs.items():
        known = np.isfinite(values)
        if known.sum() < _FEWEST or _constant(values[known]):
            continue
        found[output] = {
            name: float(_stats.spearmanr(own[known], values[known]).statistic)
            for name, own in factors.items()
            if np.ptp(own[known]) > 0.0
        }
    return found


def sobol_indices(
    factors: Sequence[str], outputs: Mapping[str, FloatArray], runs: int, seed: int
) -> dict[str, dict[str, SobolIndex]]:
    """Sobol' indices from the runs of a sensitivity design (Saltelli et al. 2010).

    Args:
        factors: names, in the design's order.
        outputs: name -> (runs x (factors + 2),), in the design's order, NaN where a run failed.
        runs: base sample of the design.
        seed: of the bootstrap; that of scipy takes none.

    Returns:
        Output -> factor -> index. Without outputs that do not vary or that some run does not have:
        the design needs every run.
    """
    drawn = np.random.default_rng(seed).integers(0, runs, (_RESAMPLES, runs))
    found: dict[str, dict[str, SobolIndex]] = {}
    for output, values in outputs.items():
        if not np.all(np.isfinite(values)) or _constant(values):
            continue
        parts = values.reshape(len(factors) + 2, runs)
        first, total = _indices(parts)
        spread = np.array([_indices(parts[:, places]) for places in drawn])
        low, high = np.nanquantile(spread, (0.025, 0.975), axis=0)
        found[output] = {
            name: SobolIndex(
                first=float(first[i]),
                first_interval95=(float(low[0, i]), float(high[0, i])),
                total=float(total[i]),
                total_interval95=(float(low[1, i]), float(high[1, i])),
            )
            for i, name in enumerate(factors)
        }
    return found


def _indices(parts: FloatArray) -> tuple[FloatArray, FloatArray]:
    """First and total indices, each (factors,), of outputs (factors + 2, n)."""
    one = parts[:, np.newaxis]
    found = _stats.sobol_indices(
        func={"f_A": one[0], "f_B": one[1], "f_AB": one[2:]}, n=parts.shape[1]
    )
    return np.atleast_1d(found.first_order), np.atleast_1d(found.total_order)


def _constant(values: FloatArray) -> bool:
    return float(np.ptp(values)) <= _CONSTANT * float(np.max(np.abs(values)))
