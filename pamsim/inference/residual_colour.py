"""Colour of the noise behind fitted residuals, corrected for what the fit has followed.

A fit with p parameters follows the slow part of the noise: an AR model of what is left is too white
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

from pamsim.core.units import FloatArray
from pamsim.inference.coloured_noise import LARGEST_REFLECTION, MOST_ORDERS, ArNoise, aicc_penalty

_toeplitz_times: Any = scipy.linalg.matmul_toeplitz


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


def slow_gains(noise: ArNoise, records: Sequence[FittedRows]) -> list[FloatArray]:
    """O G of each record: the covariance matrix of the noise times the gain, shape (n, p)."""
    if noise.order == 0:
        return [noise.variance * r.gain for r in records]
    lags = noise.autocovariance(max(r.residual.size for r in records))
    return [_toeplitz_times(lags[: r.residual.size], r.gain) for r in records]


def noise_in_estimate(records: Sequence[FittedRows], slow: Sequence[FloatArray]) -> FloatArray:
    """Covariance of the estimate due to noise in these records: sum of G^T O G, shape (p, p)."""
    return np.sum([r.gain.T @ og for r, og in zip(records, slow, strict=True)], axis=0)


def effective_samples(noise: ArNoise, records: Sequence[FittedRows]) -> float:
    """How many white samples would give a variance estimate as sure as these records do."""
    lags = noise.autocovariance(max(r.residual.size for r in records))
    total = sum(r.residual.size for r in records)
    return total / (1.0 + 2.0 * float(np.sum((lags[1:] / lags[0]) ** 2))) if lags[0] else total


def fit_colour(
    records: Sequence[FittedRows],
    slow: Sequence[FloatArray],
    covariance: FloatArray,
    *,
    ordered: bool,
) -> Colour:
    """Fit AR models to the corrected autocovariance.

    Args:
        records: of one channel and sample interval.
        slow: from `slow_gains` with the noise as known so far.
        covariance: of the estimate with that noise, shape (p, p).
        ordered: False for rows without order in time: white.

    Source: Levinson's recursion; AICc of Hurvich and Tsai, Biometrika 76 (1989).
    """
    total = sum(r.residual.size for r in records)
    shortest = min(r.residual.size for r in records)
    most = min(MOST_ORDERS, total // 10, shortest // 4) if ordered else 0
    lags = np.zeros(most + 1)
    for r, og in zip(records, slow, strict=True):
        lags += _lag_sums(r.residual[:, np.newaxis], r.residual[:, np.newaxis], most)
        lags += _lag_sums(r.jacobian, og, most) + _lag_sums(og, r.jacobian, most)
        lags -= _lag_sums(r.jacobian @ covariance, r.jacobian, most)
    # Divided by the count of all samples, not of the pairs: only so the recursion stays stable.
    return _levinson(lags / total, total)


def _levinson(lags: FloatArray, total: int) -> Colour:
    variance = float(lags[0])
    best = ArNoise((), max(variance, 0.0))
    if variance <= 0.0:
        return Colour(best, best)
    score = total * np.log(variance) + aicc_penalty(1, total)
    predictor, reflections = np.array([1.0]), []
    for k in range(1, lags.size):
        reflection = -float(predictor @ lags[k:0:-1]) / variance
        reflection = float(np.clip(reflection, -LARGEST_REFLECTION, LARGEST_REFLECTION))
        longer = np.append(predictor, 0.0)
        predictor = longer + reflection * longer[::-1]
        reflections.append(reflection)
        variance *= 1.0 - reflection**2
        now = total * np.log(variance) + aicc_penalty(k + 1, total)
        if now < score:
            best, score = ArNoise(tuple(reflections), variance), now
    return Colour(best, ArNoise(tuple(reflections), variance))


def _lag_sums(first: FloatArray, second: FloatArray, most: int) -> FloatArray:
    """Sum over t and columns of first[t] second[t + k] at k = 0 ... most, shape (most + 1,)."""
    if most == 0:
        return np.array([np.sum(first * second)])
    length = 1 << (first.shape[0] + most - 1).bit_length()
    spectrum, other = (np.fft.rfft(side, length, axis=0) for side in (first, second))
    return np.fft.irfft(np.sum(np.conj(spectrum) * other, axis=1), length)[: most + 1]
