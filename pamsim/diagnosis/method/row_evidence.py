"""Whether one model predicts unseen rows better than another, by more than luck."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_FLIPS = 9_999
_RESAMPLES = 4_000
_BLOCK = 500  # of flips at a time, so that large tables fit into memory


@dataclass(frozen=True, kw_only=True)
class RowGain:
    """By how much the squared errors of one model are below those of another.

    Attributes:
        gain: mean difference of squared errors [SI squared].
        error: its standard error over the rows.
        p_value: one-sided, of no gain.
    """

    gain: float
    error: float
    p_value: float

    @property
    def in_errors(self) -> float:
        """The gain in standard errors; 0 for models that are one."""
        return self.gain / self.error if self.error > 0.0 else 0.0


def compare_rows(before: FloatArray, after: FloatArray, *, seed: int = 0) -> RowGain:
    """Paired comparison of two models at rows that neither has seen.

    Where neither is better, each row's difference of squared errors may as well have the other
    sign: that is what the p-value is counted over, whatever the errors' distribution.

    Args:
        before: (n,) errors of the one [SI].
        after: (n,) of the other.
        seed: of the sign flips.
    """
    # In the order of size, so that the order of a table's rows changes nothing.
    difference = before**2 - after**2
    difference = difference[np.lexsort((difference, np.abs(difference)))]
    count = difference.size
    gain = float(np.mean(difference))
    error = float(np.std(difference, ddof=1)) / np.sqrt(count) if count > 1 else np.inf
    rng = np.random.default_rng(seed)
    limit = gain - 1e-12 * float(np.mean(np.abs(difference)))
    beyond, left = 0, _FLIPS
    while left > 0:
        signs = rng.choice([-1.0, 1.0], (min(_BLOCK, left), count))
        beyond += int(np.sum(signs @ difference / count >= limit))
        left -= _BLOCK
    return RowGain(gain=gain, error=float(error), p_value=(1 + beyond) / (1 + _FLIPS))


def rms_interval95(errors: FloatArray, *, seed: int = 0) -> tuple[float, float]:
    """Bootstrap interval of a root mean square over rows.

    Args:
        errors: (n,) [SI].
        seed: of the resamples.
    """
    squares = np.sort(errors**2)
    rng = np.random.default_rng(seed)
    drawn = rng.integers(0, squares.size, (_RESAMPLES, squares.size))
    low, high = np.quantile(np.sqrt(squares[drawn].mean(axis=1)), [0.025, 0.975])
    return float(low), float(high)
