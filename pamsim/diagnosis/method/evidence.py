"""Whether one model predicts unseen rows of a table, or levels of a loop, better than another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from pamsim.core.units import FloatArray
from pamsim.inference.permutation import sign_flip_p_value

_FLIPS = 9_999


@dataclass(frozen=True, kw_only=True)
class Improvement:
    """By how much the held-out loss of one model is below that of another.

    Attributes:
        gain: mean difference of the squared errors [SI squared].
        error: its standard error.
        degrees: of freedom of that error.
        p_value: one-sided, of no gain.
    """

    gain: float
    error: float
    degrees: float
    p_value: float

    @property
    def standard_errors(self) -> float:
        """The gain in standard errors; 0 for identical models."""
        return self.gain / self.error if self.error > 0.0 else 0.0


@dataclass(frozen=True, kw_only=True)
class Share:
    """Share of what a base model misses that a better one removes.

    Attributes:
        value: in [0, 1].
        interval95: from the scatter of rows or levels; None where there are too few.
    """

    value: float
    interval95: tuple[float, float] | None


def share_of_rows(before: FloatArray, after: FloatArray) -> Share:
    """Share of the base model's mean square at unseen rows or levels that a model removes.

    Args:
        before: (n,) errors of the base model.
        after: (n,) of the model.
    """
    removed, missed = before**2 - after**2, before**2
    if removed.mean() <= 0.0:
        return Share(value=0.0, interval95=None)
    ratio = float(removed.mean() / missed.mean())
    value = min(ratio, 1.0)
    if before.size < 2:
        return Share(value=value, interval95=None)
    # Of a ratio of two means, by the delta method.
    scatter = (removed - ratio * missed) / missed.mean()
    error = float(np.std(scatter, ddof=1)) / np.sqrt(scatter.size)
    reach = float(student.ppf(0.975, scatter.size - 1)) * error
    low, high = np.clip([ratio - reach, ratio + reach], 0.0, 1.0).tolist()
    return Share(value=value, interval95=(low, high))


def compare_rows(before: FloatArray, after: FloatArray, *, seed: int = 0) -> Improvement:
    """Paired sign-flip test of two models at rows that neither has seen.

    Where neither is better, each row's difference of squared errors may as well have the other
    sign: the p-value counts these, whatever the errors' distribution.

    Args:
        before: (n,) errors of the one [SI].
        after: (n,) of the other.
        seed: random seed of the sign flips.
    """
    # In the order of size, so that the order of a table's rows changes nothing.
    difference = before**2 - after**2
    difference = difference[np.lexsort((difference, np.abs(difference)))]
    count = difference.size
    error = float(np.std(difference, ddof=1)) / np.sqrt(count) if count > 1 else np.inf
    p_value = sign_flip_p_value(
        lambda signs: signs @ difference / count,
        count,
        _FLIPS,
        np.random.default_rng(seed),
        scale=float(np.mean(np.abs(difference))),
    )
    return Improvement(
        gain=float(np.mean(difference)), error=float(error), degrees=count - 1.0, p_value=p_value
    )
