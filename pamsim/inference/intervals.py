"""Covariance of calibrated parameters that holds under coloured noise and between trials.

The estimate solves J^T W^2 r = 0. Its covariance is the sandwich H^-1 B H^-1 with H = J^T W^2 J and
B the covariance of the scores J^T W^2 r (Huber, Berkeley Symposium 1967; White, Econometrica 50,
1982). B is put together from

* repeats, if there are enough: the scatter of the trials' scores about the mean of their protocol.
  It holds whatever the noise, and where parameters differ a little from trial to trial;
* other trials: autoregressive noise per channel, see below;
* rows without order in time: white noise;
* priors: their own information.

How much slow noise moves an estimate hangs on the coefficients of its model, which a few
correlation times determine badly: the variances have as few degrees of freedom
(`degrees_of_freedom`). How often the intervals hold: scripts/calibrate_study.py.

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
import scipy.special

from pamsim.core.units import FloatArray
from pamsim.inference.coloured_noise import LARGEST_REFLECTION, MOST_ORDERS, ArNoise, aicc_penalty
from pamsim.inference.residual_block import BlockPlace
from pamsim.inference.simulator_fit import Linearisation

_student_quantile: Any = scipy.special.stdtrit
_toeplitz_times: Any = scipy.linalg.matmul_toeplitz

_FEWEST_DEGREES = 3
"""Of freedom, over all protocols, from which the scatter of repeats counts: Student's quantile is
3.2 then, and 4.3 with two. Where trials of two protocols differ by the size of the noise, three
repeats of each cover 91 to 98 %, and 76 to 87 % if the noise is taken from within the trials."""
_ROUNDS = 4  # the colour's correction depends on the colour
_SETTLED = 0.02  # relative change of variance
_MANY = 1e6  # degrees of freedom beyond which Student's t is normal
_STEP = 1e-4  # of a reflection coefficient, for derivatives
_TINY = 1e-300  # keeps the logarithm of a variance that is 0 finite


@dataclass(frozen=True)
class ParameterCovariance:
    """Covariance of the parameters' places in their ranges.

    Attributes:
        matrix: shape (p, p); rows and columns of parameters outside the basis are 0.
        white: the same had the noise been white and as large as the weights say, shape (p, p).
        quantile: standard errors to either end of the 95 % interval, shape (p,).
        method: in words.
    """

    matrix: FloatArray
    white: FloatArray
    quantile: FloatArray
    method: str


_Part = tuple[FloatArray, FloatArray | float]
"""A contribution to the covariance, shape (p, p), and the degrees of freedom of each variance."""


def parameter_covariance(
    linear: Linearisation, basis: FloatArray, information: FloatArray
) -> ParameterCovariance:
    """Estimate the covariance of the optimum.

    Args:
        linear: the simulator at the optimum.
        basis: determined directions, shape (p, q).
        information: of the priors, per squared range, shape (p, p).
    """
    weighted = linear.jacobian * linear.weight[:, np.newaxis]
    along = weighted @ basis
    white = basis @ np.linalg.solve(along.T @ along + basis.T @ information @ basis, basis.T)
    gain = (weighted * linear.weight[:, np.newaxis]) @ white
    repeated, single = _split(linear.places)
    sure: list[_Part] = [(white @ information @ white, _MANY)]
    sure += [_scatter(trials, linear.residual, gain) for trials in repeated]
    groups = [
        [
            FittedRows(linear.residual[r], linear.jacobian[r], gain[r])
            for r in (p.rows for p in group)
        ]
        for group in single
    ]
    shares = [sum(float(np.sum(r.jacobian * r.gain)) for r in records) for records in groups]
    preferred = longest = [
        ArNoise((), float(np.mean(np.concatenate([r.residual for r in records]) ** 2)))
        for records in groups
    ]
    total = np.zeros_like(white)
    for _ in range(_ROUNDS if groups else 0):
        before = np.diag(total)
        slow = [slow_gains(noise, r) for noise, r in zip(preferred, groups, strict=True)]
        parts = [noise_in_estimate(r, og) for r, og in zip(groups, slow, strict=True)]
        total = np.sum([matrix for matrix, _ in sure] + parts, axis=0)
        colours = [
            fit_colour(records, og, total, ordered=group[0].block.sample_interval is not None)
            for records, og, group in zip(groups, slow, single, strict=True)
        ]
        preferred, longest = map(list, zip(*colours, strict=True))
        if np.all(np.abs(np.diag(total) - before) <= _SETTLED * before):
            break
    matrix, quantile = _together([*sure, *_coloured_parts(preferred, groups, shares)])
    wide, wide_quantile = _together([*sure, *_coloured_parts(longest, groups, shares)])
    # Slow drift below the sample noise escapes AICc, and the longest model alone is too unsure of
    # itself; the wider of the two covers best over the noises tried.
    variance = np.maximum(np.diag(matrix), 0.0)
    np.fill_diagonal(matrix, variance)  # of data without noise, rounding leaves less than 0
    ratio = np.sqrt(np.maximum(np.diag(wide), 0.0) / np.where(variance > 0.0, variance, 1.0))
    wider = ratio * wide_quantile > quantile
    factor = np.where(wider, ratio, 1.0)
    return ParameterCovariance(
        matrix=matrix * np.outer(factor, factor),
        white=white,
        quantile=np.where(wider, wide_quantile, quantile),
        method=_method(repeated, single, preferred),
    )


def _split(
    places: Sequence[BlockPlace],
) -> tuple[list[dict[str, list[BlockPlace]]], list[list[BlockPlace]]]:
    """Protocols with repeats (trial -> blocks), and the other blocks by kind of noise."""
    protocols: dict[str, dict[str, list[BlockPlace]]] = {}
    for place in places:
        trials = protocols.setdefault(place.block.protocol, {})
        trials.setdefault(place.block.trial, []).append(place)
    degrees = sum(len(trials) - 1 for trials in protocols.values())
    fewest = 2 if degrees >= _FEWEST_DEGREES else len(places) + 1
    repeated = [trials for trials in protocols.values() if len(trials) >= fewest]
    groups: dict[tuple[str, str], list[BlockPlace]] = {}
    for trials in protocols.values():
        if len(trials) < fewest:
            for place in (p for blocks in trials.values() for p in blocks):
                interval = place.block.sample_interval
                clock = "" if interval is None else f"{interval:.2e}"
                groups.setdefault((place.block.channel, clock), []).append(place)
    return repeated, list(groups.values())


def _scatter(trials: dict[str, list[BlockPlace]], residual: FloatArray, gain: FloatArray) -> _Part:
    pulls = np.array(
        [sum(gain[p.rows].T @ residual[p.rows] for p in blocks) for blocks in trials.values()]
    )
    count = len(pulls)
    centred = pulls - pulls.mean(axis=0)
    return count / (count - 1.0) * centred.T @ centred, count - 1.0


def _coloured_parts(
    noises: Sequence[ArNoise], groups: Sequence[Sequence[FittedRows]], shares: Sequence[float]
) -> list[_Part]:
    return [
        (
            noise_in_estimate(records, slow_gains(noise, records)),
            degrees_of_freedom(noise, records, share),
        )
        for noise, records, share in zip(noises, groups, shares, strict=True)
    ]


def _together(parts: Sequence[_Part]) -> tuple[FloatArray, FloatArray]:
    """Sum of the parts, and Student's quantiles with its degrees of freedom.

    Those of a sum of variances are few where one of few is most of it (Satterthwaite, Biometrics 2,
    1946).
    """
    matrix = np.sum([part for part, _ in parts], axis=0)
    variances = np.stack([np.diag(part) for part, _ in parts])
    degrees = np.stack([np.broadcast_to(freedom, len(matrix)) for _, freedom in parts])
    spread = np.sum(variances**2 / degrees, axis=0)
    some = spread > 0.0
    effective = np.sum(variances, axis=0) ** 2 / np.where(some, spread, 1.0)
    degrees = np.minimum(np.where(some, effective, _MANY), _MANY)
    return matrix, _student_quantile(degrees, 0.975)


def _method(
    repeated: Sequence[object], single: Sequence[Sequence[BlockPlace]], noises: Sequence[ArNoise]
) -> str:
    parts: list[str] = []
    if repeated:
        parts.append(f"scatter of trials about the mean of their protocol ({len(repeated)})")
    orders = [
        f"{group[0].block.channel} order {noise.order}"
        for group, noise in zip(single, noises, strict=True)
        if group[0].block.sample_interval is not None
    ]
    if orders:
        slow = any(noise.order > 0 for noise in noises)
        held = ", of short trials with such noise about nine in ten hold" if slow else ""
        parts.append(f"autoregressive noise ({', '.join(orders)}{held})")
    if any(group[0].block.sample_interval is None for group in single):
        parts.append("white noise of rows without order in time")
    return "sandwich covariance, Student's t; " + "; ".join(parts)


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


def slow_gains(noise: ArNoise, records: Sequence[FittedRows]) -> list[FloatArray]:
    """O G of each record: the covariance matrix of the noise times the gain, shape (n, p)."""
    if noise.order == 0:
        return [noise.variance * r.gain for r in records]
    lags = noise.autocovariance(max(r.residual.size for r in records))
    return [_toeplitz_times(lags[: r.residual.size], r.gain) for r in records]


def noise_in_estimate(records: Sequence[FittedRows], slow: Sequence[FloatArray]) -> FloatArray:
    """Covariance of the estimate due to noise in these records: sum of G^T O G, shape (p, p)."""
    return np.sum([r.gain.T @ og for r, og in zip(records, slow, strict=True)], axis=0)


def degrees_of_freedom(
    noise: ArNoise, records: Sequence[FittedRows], share: float
) -> FloatArray | float:
    """Degrees of freedom of the estimate's variances, as of white samples that are as sure.

    How much slow noise moves an estimate hangs on the coefficients of the noise, which few
    correlation times determine badly (delta method; Fisher information of an AR model, Box and
    Jenkins 1970).

    Args:
        noise: of the records.
        records: of one channel and sample interval.
        share: of the fit's parameters that they determine.
    """
    samples = max(sum(r.residual.size for r in records) - share, 1.0)
    if noise.order == 0 or noise.variance == 0.0:
        return min(samples, _MANY)
    count = max(r.gain.shape[0] for r in records)
    length = 1 << (2 * count - 1).bit_length()
    power = np.sum([np.abs(np.fft.rfft(r.gain, length, axis=0)) ** 2 for r in records], axis=0)
    weights = 2.0 * np.fft.irfft(power, length, axis=0)[:count]
    weights[0] *= 0.5

    def shape(reflections: FloatArray) -> FloatArray:
        """Coefficients of the noise, and the logarithms of the estimate's variances."""
        one = ArNoise(tuple(reflections.tolist()), noise.variance)
        variances = one.autocovariance(count) @ weights
        return np.concatenate([one.coefficients, np.log(np.maximum(variances, _TINY))])

    at = np.array(noise.reflections)
    steps = np.minimum(_STEP, 0.5 * (1.0 - np.abs(at)))
    moved = [
        (shape(at + step * way) - shape(at - step * way)) / (2.0 * step)
        for step, way in zip(steps, np.eye(noise.order), strict=True)
    ]
    sensitivity = np.array(moved)  # of all to each reflection
    along = np.linalg.solve(sensitivity[:, : noise.order], sensitivity[:, noise.order :])
    information = scipy.linalg.toeplitz(noise.autocovariance(noise.order)) / noise.variance
    unsure = np.sum(along * np.linalg.solve(information, along), axis=0)
    return np.clip(2.0 * samples / (2.0 + unsure), 1.0, _MANY)


def fit_colour(
    records: Sequence[FittedRows],
    slow: Sequence[FloatArray],
    covariance: FloatArray,
    *,
    ordered: bool,
) -> tuple[ArNoise, ArNoise]:
    """Fit AR models to the corrected autocovariance: of an order by AICc, and of the highest tried.

    The longest sees slow drift too weak for AICc to spend orders on.

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


def _levinson(lags: FloatArray, total: int) -> tuple[ArNoise, ArNoise]:
    variance = float(lags[0])
    best = ArNoise((), max(variance, 0.0))
    if variance <= 0.0:
        return best, best
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
    return best, ArNoise(tuple(reflections), variance)


def _lag_sums(first: FloatArray, second: FloatArray, most: int) -> FloatArray:
    """Sum over t and columns of first[t] second[t + k] at k = 0 ... most, shape (most + 1,)."""
    if most == 0:
        return np.array([np.sum(first * second)])
    length = 1 << (first.shape[0] + most - 1).bit_length()
    spectrum, other = (np.fft.rfft(side, length, axis=0) for side in (first, second))
    return np.fft.irfft(np.sum(np.conj(spectrum) * other, axis=1), length)[: most + 1]
