"""Autoregressive model of residuals: order by AICc, whitening, autocovariance.

Residuals of a sampled mechanism are correlated from sample to sample. Intervals that take them as
white are too narrow by the square root of the samples per correlation time, easily fivefold. Here
an AR(p) model of the residuals, pooled over trials, whitens both residuals and Jacobian.
"""

# scipy carries no types: what it returns is Any at this file's boundary.
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false
# pyright: reportUnknownVariableType=false

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.signal

from pamsim.core.units import FloatArray
from pamsim.inference.autoregression import burg_reflections, filtered

_lfilter: Any = scipy.signal.lfilter
_lfiltic: Any = scipy.signal.lfiltic

MOST_ORDERS = 30
"""Of an autoregressive model: more would follow the residual's misfit, too."""

LONGEST_MEMORY = 200
"""Samples that whitening reaches back in noise with a long memory. On 1/f noise in records of 2,000
the interval of a gain holds in 96 of 100 with 200, in 39 of 40 with 2,000, at a tenth the time."""

_MEMORY = np.arange(1, 50) / 100.0
"""Exponents d tried; at 0.5 (1/f noise) the variance has no bound."""

LARGEST_REFLECTION = 0.9999
"""Magnitude of a reflection coefficient; of 1 noise would never fade."""


@dataclass(frozen=True)
class ArNoise:
    """``v(t) = phi1 v(t-1) + ... + phip v(t-p) + e(t)``, e white; p = 0 is white noise.

    Attributes:
        reflections: reflection coefficients of Burg's recursion, all inside (-1, 1), so that the
            model is stationary; the AR(k), k < p, of its first k are the predictors for the
            start of a record.
        variance: of e [output unit^2].
        memory: exponent d of noise whose spectrum grows as ``f^-2d`` towards frequency 0: the last
            reflections are those of fractionally integrated noise. 0 if it fades.
    """

    reflections: tuple[float, ...]
    variance: float
    memory: float = 0.0

    @property
    def order(self) -> int:
        """Order p."""
        return len(self.reflections)

    @property
    def coefficients(self) -> tuple[float, ...]:
        """phi1..phip."""
        return tuple(map(float, -self._predictors[-1][1:]))

    @cached_property
    def _predictors(self) -> tuple[FloatArray, ...]:
        """Prediction error filters [1, -phi1, ..., -phik] of orders k from 0 to p."""
        filters = [np.array([1.0])]
        for reflection in self.reflections:
            filters.append(longer_predictor(filters[-1], reflection))
        return tuple(filters)

    @property
    def standard_deviation(self) -> float:
        """Of v itself [output unit]."""
        return float(np.sqrt(self.autocovariance(1)[0]))

    def autocovariance(self, count: int) -> FloatArray:
        """Return the covariance of v at lags 0..count-1, shape ``(count,)`` [output unit^2]."""
        power = self.variance / float(np.prod(1.0 - np.square(self.reflections)))
        lags = [power]
        error = power
        # Levinson's recursion run backwards: reflections to autocovariances.
        for k, reflection in enumerate(self.reflections):
            past = self._predictors[k]
            foreseen = -float(past[1:] @ np.array(lags[k:0:-1])) if k else 0.0
            lags.append(foreseen - reflection * error)
            error *= 1.0 - reflection**2
        known = np.array(lags[:count])
        more = count - known.size
        if more <= 0:
            return known
        if self.order == 0:
            return np.append(known, np.zeros(more))
        denominator = np.array([1.0, *(-c for c in self.coefficients)])
        past = _lfiltic([1.0], denominator, known[:0:-1])
        return np.append(known, _lfilter([1.0], denominator, np.zeros(more), zi=past)[0])

    def correlation_time(self, sample_time: float) -> float:
        """Return the integral time: spectral density at frequency 0 over twice the variance [s].

        Of exponentially correlated noise it is the time constant; half a sample if white.
        """
        # By the reflections, of any variance, that of a perfect fit included: 1 less the sum of the
        # coefficients is the product of 1 plus each reflection, which rounding cannot make 0.
        own = np.array(self.reflections)
        return float(0.5 * sample_time * np.prod((1.0 - own) / (1.0 + own)))

    def whiten(self, values: FloatArray) -> FloatArray:
        """Turn noise of this model into white noise of the same variance as e.

        The first p samples use the predictors of lower order: no sample is lost, and the result
        is the exact Gaussian likelihood's.

        Args:
            values: shape ``(n,)`` or ``(n, m)``: one trial, or columns of its Jacobian.
        """
        if self.order == 0:
            return values
        result = filtered(self._predictors[-1], values)
        # A prediction of order k misses more than e, by what the higher orders would take off.
        shares = np.cumprod(np.sqrt(1.0 - np.square(self.reflections[::-1])))[::-1]
        for k in range(min(self.order, len(values))):
            result[k] = shares[k] * (self._predictors[k] @ values[k::-1])
        return result


def fit_ar_noise(
    residuals: Sequence[FloatArray],
    most: int = MOST_ORDERS,
    absorbed: Sequence[FloatArray] = (),
    *,
    long_memory: bool = False,
) -> ArNoise:
    """Fit an AR model to residuals pooled over trials, its order by AICc.

    Args:
        residuals: one array per trial, shape ``(n_i,)`` [output unit].
        most: highest order tried; also at most a tenth of the samples.
        absorbed: of each trial columns whose outer products sum to the covariance of the fitted
            output, shape ``(n_i, m_i)``: so much of the noise, slow noise above all, is in the
            fit instead of the residual. Empty of what was not fitted.
        long_memory: whether noise that grows towards frequency 0 (1/f) is tried, too.

    Returns:
        The model; order 0 if white noise describes the residuals best.

    Source: Burg's recursion; AICc of Hurvich and Tsai (Biometrika 1989); restricted
    likelihood of Patterson and Thompson (Biometrika 1971).
    """
    total = sum(r.size for r in residuals)
    # The expectation of restricted maximum likelihood: what was taken up counts as trials do, but
    # is no further sample.
    rows = [*residuals, *(column for columns in absorbed for column in columns.T)]
    variance = sum(float(row @ row) for row in rows) / total
    most = min(most, total // 10, min(r.size for r in residuals) // 4)
    reflections = burg_reflections(rows, most, LARGEST_REFLECTION)
    best = models_by_order(variance, reflections, total)[0]
    if not long_memory or best.variance <= 0.0 or len(reflections) < 2:
        return best
    longest = min(max(r.size for r in residuals) - 1, LONGEST_MEMORY)
    return _with_memory(best, variance, np.array(reflections), total, longest) or best


def _with_memory(
    short: ArNoise, variance: float, reflections: FloatArray, total: int, longest: int
) -> ArNoise | None:
    """The best noise whose later reflections are those of fractional noise.

    None if AICc prefers the short one. Each order of Burg's recursion multiplies the mean square
    error of prediction by ``1 - r^2`` with its own reflection r, by ``1 - r^2 + (r - s)^2`` with
    another one, s.

    Source: ``d / (k - d)``, the partial autocorrelation of fractional noise at lag k: Hosking
    (Biometrika 68, 1981).
    """
    lags, memory = np.arange(1, longest + 1), _MEMORY[:, np.newaxis]
    fading = -memory / (lags - memory)
    own = np.log1p(-np.square(reflections))
    other = np.log(np.exp(own) + np.square(reflections - fading[:, : own.size]))
    orders = np.arange(own.size)  # that keep their own reflections
    kept = np.cumsum(own) - own
    replaced = np.cumsum(other[:, ::-1], axis=1)[:, ::-1]
    scores = total * (kept + replaced) + _penalty(orders + 2.0, total)
    best, order = np.unravel_index(np.argmin(scores), scores.shape)
    plain = total * np.log(short.variance / variance) + _penalty(short.order + 1.0, total)
    if scores[best, order] >= plain:
        return None
    further = np.prod(1.0 - np.square(fading[best, own.size :]))
    return ArNoise(
        reflections=(*reflections[:order].tolist(), *fading[best, order:].tolist()),
        variance=float(variance * np.exp(kept[order] + replaced[best, order]) * further),
        memory=float(_MEMORY[best]),
    )


def within_limit(reflection: float) -> float:
    """A reflection coefficient with which noise fades."""
    return float(np.clip(reflection, -LARGEST_REFLECTION, LARGEST_REFLECTION))


def longer_predictor(predictor: FloatArray, reflection: float) -> FloatArray:
    """The prediction error filter (k + 2,) of one order more than a filter (k + 1,)."""
    longer = np.append(predictor, 0.0)
    return longer + reflection * longer[::-1]


def models_by_order(
    variance: float, reflections: Sequence[float], total: int
) -> tuple[ArNoise, ArNoise]:
    """Of models with the first 0, 1, ... reflections the best by AICc, and the longest.

    Args:
        variance: of the noise itself [output unit^2]; 0 or below gives no noise.
        reflections: of all orders tried.
        total: samples.

    Source: Hurvich and Tsai (Biometrika 1989).
    """
    if variance <= 0.0:
        return ArNoise((), 0.0), ArNoise((), 0.0)
    variances = np.cumprod([variance, *(1.0 - np.square(reflections))])
    unknowns = 1.0 + np.arange(variances.size)  # the variance is one
    scores = total * np.log(variances) + _penalty(unknowns, total)
    orders = int(np.argmin(scores)), len(reflections)
    best, longest = (ArNoise(tuple(reflections[:k]), float(variances[k])) for k in orders)
    return best, longest


def _penalty(unknowns: Any, total: int) -> Any:
    """What AICc adds for this many unknowns."""
    return 2.0 * unknowns * total / np.maximum(total - unknowns - 1.0, 1.0)
