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
(`FittedRecords.degrees_of_freedom`). How often the intervals hold: scripts/calibrate_study.py.

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
from pamsim.inference.coloured_noise import (
    MOST_ORDERS,
    ArNoise,
    longer_predictor,
    models_by_order,
    within_limit,
)
from pamsim.inference.simulator_fit import BlockPlace, Linearisation

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
    """Covariance of the parameters' places in their ranges."""

    matrix: FloatArray  # shape (p, p); rows and columns of parameters outside the basis are 0
    # The same had the noise been white and as large as the weights say, shape (p, p)
    white: FloatArray
    quantile: FloatArray  # standard errors to either end of the 95 % interval, shape (p,)
    method: str  # in words


_Part = tuple[FloatArray, FloatArray | float]
"""A contribution to the covariance, shape (p, p), and the degrees of freedom of each variance."""


def parameter_covariance(
    linear: Linearisation, basis: FloatArray, information: FloatArray
) -> ParameterCovariance:
    """Covariance of the optimum.

    ``basis`` (p, q) are the determined directions, ``information`` (p, p) that of the priors, per
    squared range.
    """
    weighted = linear.jacobian * linear.weight[:, np.newaxis]
    along = weighted @ basis
    white = basis @ np.linalg.solve(along.T @ along + basis.T @ information @ basis, basis.T)
    gain = (weighted * linear.weight[:, np.newaxis]) @ white
    repeated, single = _split(linear.places)
    sure: list[_Part] = [(white @ information @ white, _MANY)]
    sure += [_scatter(trials, linear.residual, gain) for trials in repeated]
    groups = [
        FittedRecords(
            [linear.residual[p.rows] for p in group],
            [linear.jacobian[p.rows] for p in group],
            [gain[p.rows] for p in group],
            ordered=group[0].block.sample_interval is not None,
        )
        for group in single
    ]
    noises = [(group.white_noise, group.white_noise) for group in groups]
    total = np.zeros_like(white)
    for _ in range(_ROUNDS if groups else 0):
        before = np.diag(total)
        each = [group.in_estimate(own) for group, (own, _) in zip(groups, noises, strict=True)]
        total = np.sum([matrix for matrix, _ in sure] + each, axis=0)
        noises = [group.colours(own, total) for group, (own, _) in zip(groups, noises, strict=True)]
        if np.all(np.abs(np.diag(total) - before) <= _SETTLED * before):
            break
    (matrix, quantile), (wide, wide_quantile) = (
        _together([*sure, *(g.part(noise[k]) for g, noise in zip(groups, noises, strict=True))])
        for k in (0, 1)
    )
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
        method=_method(repeated, single, [own for own, _ in noises]),
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
    return matrix, scipy.special.stdtrit(degrees, 0.975)


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


class FittedRecords:
    """Records of one channel and rate: what a fit left, and how the estimate hangs on it.

    Args:
        residuals: of each record, shape (n,) [SI unit of the channel].
        jacobians: change of each residual with the estimate, shape (n, p).
        gains: G, the estimate's response to noise in the rows of each, shape (n, p).
        ordered: False for rows without order in time, whose noise is white.
    """

    def __init__(
        self,
        residuals: Sequence[FloatArray],
        jacobians: Sequence[FloatArray],
        gains: Sequence[FloatArray],
        *,
        ordered: bool = True,
    ) -> None:
        self._residuals, self._jacobians, self._gains = residuals, jacobians, gains
        sizes = [r.size for r in residuals]
        self._longest, self._samples = max(sizes), sum(sizes)
        self._most = min(MOST_ORDERS, self._samples // 10, min(sizes) // 4) if ordered else 0

    @property
    def white_noise(self) -> ArNoise:
        """White noise as large as the residual."""
        return ArNoise((), float(np.mean(np.concatenate(self._residuals) ** 2)))

    def part(self, noise: ArNoise) -> _Part:
        """What noise in these records adds to the covariance, and how sure that is."""
        return self.in_estimate(noise), self.degrees_of_freedom(noise)

    def in_estimate(self, noise: ArNoise) -> FloatArray:
        """Covariance of the estimate by noise in these records: sum of G^T O G, shape (p, p)."""
        slow = self._slow_gains(noise)
        return np.sum([gain.T @ og for gain, og in zip(self._gains, slow, strict=True)], axis=0)

    def _slow_gains(self, noise: ArNoise) -> list[FloatArray]:
        """O G of each record: the covariance matrix of the noise times the gain, shape (n, p)."""
        if noise.order == 0:
            return [noise.variance * gain for gain in self._gains]
        lags = noise.autocovariance(self._longest)
        return [_toeplitz_times(lags[: len(gain)], gain) for gain in self._gains]

    def degrees_of_freedom(self, noise: ArNoise) -> FloatArray | float:
        """Degrees of freedom of the estimate's variances, as of white samples that are as sure.

        How much slow noise moves an estimate hangs on the coefficients of the noise, which few
        correlation times determine badly (delta method; Fisher information of an AR model, Box and
        Jenkins 1970).
        """
        pairs = zip(self._jacobians, self._gains, strict=True)
        share = sum(float(np.sum(jacobian * gain)) for jacobian, gain in pairs)  # of the parameters
        samples = max(self._samples - share, 1.0)
        if noise.order == 0 or noise.variance == 0.0:
            return min(samples, _MANY)
        count = self._longest
        length = 1 << (2 * count - 1).bit_length()
        power = np.sum([np.abs(np.fft.rfft(g, length, axis=0)) ** 2 for g in self._gains], axis=0)
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
        # Reflections at their limit, far from an optimum, do not move the coefficients.
        coefficients, variances = np.split(sensitivity, [noise.order], axis=1)
        along: FloatArray = np.linalg.lstsq(coefficients, variances, rcond=None)[0]
        information = scipy.linalg.toeplitz(noise.autocovariance(noise.order)) / noise.variance
        unsure = np.sum(along * np.linalg.lstsq(information, along, rcond=None)[0], axis=0)
        # Overflow leaves no number: then nothing is sure.
        return np.clip(np.nan_to_num(2.0 * samples / (2.0 + unsure), nan=1.0), 1.0, _MANY)

    def colours(self, noise: ArNoise, covariance: FloatArray) -> tuple[ArNoise, ArNoise]:
        """AR models of the corrected autocovariance: of an order by AICc, and of the highest.

        The longest sees slow drift too weak for AICc to spend orders on. ``covariance`` (p, p) is
        that of the estimate with the noise as known so far.

        Source: Levinson's recursion; AICc of Hurvich and Tsai, Biometrika 76 (1989).
        """
        lags, slow = np.zeros(self._most + 1), self._slow_gains(noise)
        for residual, jacobian, og in zip(self._residuals, self._jacobians, slow, strict=True):
            lags += _lag_sums(residual[:, np.newaxis], residual[:, np.newaxis], self._most)
            lags += _lag_sums(jacobian, og, self._most) + _lag_sums(og, jacobian, self._most)
            lags -= _lag_sums(jacobian @ covariance, jacobian, self._most)
        # Divided by the count of all samples, not of the pairs: only so the recursion stays stable.
        lags /= self._samples
        reflections: list[float] = []
        predictor, error = np.array([1.0]), float(lags[0])
        for k in range(1, lags.size if error > 0.0 else 1):
            reflections.append(within_limit(-float(predictor @ lags[k:0:-1]) / error))
            predictor = longer_predictor(predictor, reflections[-1])
            error *= 1.0 - reflections[-1] ** 2
        return models_by_order(float(lags[0]), reflections, self._samples)


def _lag_sums(first: FloatArray, second: FloatArray, most: int) -> FloatArray:
    """Sum over t and columns of first[t] second[t + k] at k = 0 ... most, shape (most + 1,)."""
    if most == 0:
        return np.array([np.sum(first * second)])
    length = 1 << (first.shape[0] + most - 1).bit_length()
    spectrum, other = (np.fft.rfft(side, length, axis=0) for side in (first, second))
    return np.fft.irfft(np.sum(np.conj(spectrum) * other, axis=1), length)[: most + 1]
