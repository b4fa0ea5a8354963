"""Colour of the noise behind fitted residuals, corrected for what the fit has absorbed.

A fit with p parameters absorbs the slow part of the noise: an AR model of what is left is too white
and intervals built on it too narrow. For noise e of covariance O and an estimate that responds by
-G^T e, the residual r = e - J G^T e has the covariance

    O - J (O G)^T - (O G) J^T + J C J^T,    C = covariance of the estimate,

so that its autocovariance can be corrected by what the formula says is missing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg
import scipy.signal
from numpy.typing import NDArray

from pamsim.sysid.coloured_noise import ArNoise

FloatArray = NDArray[np.float64]
_toeplitz_times: Any = scipy.linalg.matmul_toeplitz

_MOST_ORDERS = 30
_LARGEST_REFLECTION = 0.9999


@dataclass(frozen=True)
class FittedRows:
    """One record of a fit: what was left, and how it is tied to the estimate.

    Attributes:
        residual: shape (n,) [SI unit of the channel].
        jacobian: change of the residual with the estimate, shape (n, p).
        gain: G, the estimate's response to noise in these rows, shape (n, p).
    """

    residual: FloatArray
    jacobian: FloatArray
    gain: FloatArray


@dataclass(frozen=True)
class Colour:
    """Two models of the same noise.

    Attributes:
        preferred: order by AICc.
        longest: highest order tried. It sees slow drift too weak for AICc to spend orders on.
    """

    preferred: ArNoise
    longest: ArNoise


def autocovariance(noise: ArNoise, count: int) -> FloatArray:
    """Covariance of AR noise at lags 0 to ``count`` - 1, shape (count,) [squared unit].

    The same as the noise's own, for thousands of lags: its first lags solve the Yule-Walker
    equations, the others follow by filtering.
    """
    p = noise.order
    if p == 0:
        return np.concatenate([[noise.variance], np.zeros(count - 1)])
    polynomial = np.concatenate([[1.0], -np.array(noise.coefficients)])
    lag = np.abs(np.subtract.outer(np.arange(p + 1), np.arange(p + 1)))
    equations = np.zeros((p + 1, p + 1))
    np.add.at(equations, (np.arange(p + 1)[:, np.newaxis], lag), polynomial)
    first = np.linalg.solve(equations, np.concatenate([[noise.variance], np.zeros(p)]))
    if count <= p + 1:
        return first[:count]
    state = scipy.signal.lfiltic([1.0], polynomial, first[:0:-1])
    rest, _ = scipy.signal.lfilter([1.0], polynomial, np.zeros(count - p - 1), zi=state)
    return np.concatenate([first, rest])


def noise_in_estimate(noise: ArNoise, records: Sequence[FittedRows]) -> FloatArray:
    """Covariance of the estimate due to noise in these records: sum of G^T O G, shape (p, p)."""
    lags = autocovariance(noise, max(r.residual.size for r in records))
    return np.sum([r.gain.T @ _coloured(noise, lags, r.gain) for r in records], axis=0)


def effective_samples(noise: ArNoise, records: Sequence[FittedRows]) -> float:
    """How many white samples would give a variance estimate as sure as these records do."""
    lags = autocovariance(noise, max(r.residual.size for r in records))
    total = sum(r.residual.size for r in records)
    return total / (1.0 + 2.0 * float(np.sum((lags[1:] / lags[0]) ** 2))) if lags[0] else total


def fit_colour(
    records: Sequence[FittedRows], covariance: FloatArray, known: ArNoise, *, ordered: bool
) -> Colour:
    """Fit AR models to the corrected autocovariance.

    Args:
        records: of one channel and sample interval.
        covariance: of the estimate according to ``known``, shape (p, p).
        known: the model so far, from which the correction is computed.
        ordered: False for rows without order in time: white.

    Returns:
        The models.

    Source: Levinson's recursion; AICc of Hurvich and Tsai, Biometrika 76 (1989).
    """
    total = sum(r.residual.size for r in records)
    shortest = min(r.residual.size for r in records)
    most = min(_MOST_ORDERS, total // 10, shortest // 4) if ordered else 0
    lags = np.zeros(most + 1)
    model = autocovariance(known, max(r.residual.size for r in records))
    for r in records:
        slow = _coloured(known, model, r.gain)
        lags += _lag_sums(r.residual[:, np.newaxis], r.residual[:, np.newaxis], most)
        lags += _lag_sums(r.jacobian, slow, most) + _lag_sums(slow, r.jacobian, most)
        lags -= _lag_sums(r.jacobian @ covariance, r.jacobian, most)
    # Divided by the count of all samples, not of the pairs: only so the recursion stays stable.
    return _levinson(lags / total, total)


def _levinson(lags: FloatArray, total: int) -> Colour:
    variance = float(lags[0])
    best = ArNoise((), max(variance, 0.0))
    if variance <= 0.0:
        return Colour(best, best)
    score = total * np.log(variance) + _penalty(1, total)
    predictor, reflections = np.array([1.0]), []
    for k in range(1, lags.size):
        reflection = -float(predictor @ lags[k:0:-1]) / variance
        reflection = float(np.clip(reflection, -_LARGEST_REFLECTION, _LARGEST_REFLECTION))
        longer = np.append(predictor, 0.0)
        predictor = longer + reflection * longer[::-1]
        reflections.append(reflection)
        variance *= 1.0 - reflection**2
        now = total * np.log(variance) + _penalty(k + 1, total)
        if now < score:
            best, score = ArNoise(tuple(reflections), variance), now
    return Colour(best, ArNoise(tuple(reflections), variance))


def _penalty(parameters: int, total: int) -> float:
    return 2.0 * parameters * total / max(total - parameters - 1, 1)


def _coloured(noise: ArNoise, lags: FloatArray, columns: FloatArray) -> FloatArray:
    """Covariance matrix of the noise times columns, shape (n, p)."""
    if noise.order == 0:
        return noise.variance * columns
    return _toeplitz_times(lags[: columns.shape[0]], columns)


def _lag_sums(first: FloatArray, second: FloatArray, most: int) -> FloatArray:
    """Sum over t and columns of first[t] second[t + k] at k = 0 ... most, shape (most + 1,)."""
    if most == 0:
        return np.array([np.sum(first * second)])
    length = 1 << (first.shape[0] + most - 1).bit_length()
    one, two = (np.fft.rfft(side, length, axis=0) for side in (first, second))
    return np.fft.irfft(np.sum(np.conj(one) * two, axis=1), length)[: most + 1]
