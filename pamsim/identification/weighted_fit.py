"""A fit whose intervals hold under coloured noise: noise model, weighted refit, and which to keep.

With the right structure, whitening by the noise model gives the most precise estimates, and
intervals at the stated coverage. With a wrong one (hysteresis, a missing lag) the residuals contain
the model's own error, and whitening gives a model that predicts one step well and simulates badly.
So the weighted estimates are kept only if they lie within the uncertainty of the unweighted ones,
and do not simulate much worse: where that uncertainty is large, nearly everything lies within it.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from typing import Any

import numpy as np
import scipy.signal
import scipy.special

from pamsim.core.units import FloatArray
from pamsim.identification.optimum import Optimum, student_quantile
from pamsim.identification.separable import (
    Linearised,
    Separable,
    Solution,
    linearise,
    minimise,
)
from pamsim.identification.triangular import triangular_factor
from pamsim.inference.coloured_noise import ArNoise
from pamsim.inference.trial_noise import WHITE, TrialNoise, fit_trial_noise

_chi2_tail: Any = scipy.special.chdtrc
_convolve: Any = scipy.signal.oaconvolve

_SINGULAR = 1e-8
"""Smallest over largest singular value of a column-scaled Jacobian by differences, which has errors
of this size."""
_SMALL = 1e-15  # covariance over variance, from which it is rounding
_ROUNDS = 4  # of noise model and weighted fit: it settles in two or three
_SETTLED = 0.02  # change between rounds, in standard errors
_DISAGREE = 0.01  # p-value below which the weighted estimates are rejected
_MUCH_WORSE = 1.5  # RMS error of the free run over the unweighted one's
_FEWEST = 4.0
"""Degrees of freedom at least, where noise is so slow that a record holds few independent samples:
most of such noise is in the offset and start that each trial has of its own."""
_PERFECT = 1e-9  # residual over output, RMS: below it there is only rounding


class Weights(StrEnum):
    """What a fit minimises, and what its intervals allow for."""

    NOISE = "noise"
    """The error weighted by the noise model, if that is trusted; coloured noise."""
    EQUAL = "equal"
    """The plain error; coloured noise."""
    WHITE = "white"
    """The plain error; white noise."""


def fit_separable(
    problem: Separable, starts: Sequence[FloatArray], weights: Weights = Weights.NOISE
) -> Optimum:
    """Fit plainly, model the residuals, refit whitened, keep the better supported estimates."""
    plain = minimise(problem, starts)
    line = linearise(problem, plain.x, plain.theta, WHITE)
    sizes = [output.size for output in problem.outputs]
    total, free = sum(sizes), plain.coordinates.size + line.own
    freedom = max(total - free, 1)

    def found(
        solution: Solution,
        covariance: FloatArray | None,
        noise: TrialNoise,
        **more: Any,
    ) -> Optimum:
        # Noise is known by its independent samples, however densely it is sampled.
        known = max(noise.independent(sizes) - free, _FEWEST)
        quantile = student_quantile(known if weights is Weights.NOISE else freedom)
        return Optimum(
            coordinates=solution.coordinates,
            covariance=covariance,
            quantile=quantile,
            settled=solution.settled,
            noise=noise,
            **more,
        )

    moves = sum(float(np.sum((y - np.mean(y)) ** 2)) for y in problem.outputs)
    if plain.cost <= _PERFECT**2 * moves:
        noise = TrialNoise((ArNoise((), plain.cost / freedom),) * len(problem.outputs))
        return found(plain, _whitened_covariance(line), noise)
    noise = fit_trial_noise(line.residuals, problem.sample_times, long_memory=True)
    if weights is Weights.WHITE:
        return found(plain, _whitened_covariance(line), noise)
    # The residuals of a fit are smaller than the errors.
    robust = _sandwich_covariance(line, noise.scaled(total / freedom))
    if weights is Weights.EQUAL:
        return found(plain, robust, noise)
    if noise.white or robust is None:
        return found(plain, _whitened_covariance(line), noise)
    kept, covariance = plain, robust
    for rounds in range(_ROUNDS):
        better = minimise(problem, [kept.x], noise)
        line = linearise(problem, better.x, better.theta, noise)
        latest = _whitened_covariance(line)
        if latest is None or not better.settled:
            return found(plain, robust, noise)
        change = better.coordinates - kept.coordinates
        kept, covariance = better, latest
        if rounds and np.max(np.abs(change) / np.sqrt(np.diag(latest))) < _SETTLED:
            break
        noise = _noise_of_fit(line, latest)
    moved = kept.coordinates - plain.coordinates
    distance = float(moved @ np.linalg.lstsq(robust, moved, rcond=None)[0])
    p_value = float(_chi2_tail(moved.size, max(distance, 0.0)))
    free_run = np.concatenate(linearise(problem, kept.x, kept.theta, WHITE).residuals)
    much_worse = float(free_run @ free_run) > _MUCH_WORSE**2 * plain.cost
    if p_value < _DISAGREE or much_worse:
        first = linearise(problem, plain.x, plain.theta, WHITE).residuals
        noise = fit_trial_noise(first, problem.sample_times, long_memory=True)
        return found(plain, robust, noise, disagreement=p_value)
    return found(kept, covariance, noise, disagreement=p_value, weighted=True)


def _noise_of_fit(line: Linearised, covariance: FloatArray) -> TrialNoise:
    """A noise model of the residuals that allows for what the fit took up of the noise.

    The line is whitened as the fit was; the covariance is that of (x, theta).
    """
    sizes, vectors = np.linalg.eigh(covariance)
    half = vectors * np.sqrt(np.maximum(sizes, 0.0))
    deviation = np.sqrt(line.noise.variance)
    absorbed = [np.hstack([deviation * own, rest @ half]) for _, own, rest in line.plain]
    residuals = [residual for residual, _, _ in line.plain]
    return fit_trial_noise(residuals, line.sample_times, absorbed, long_memory=True)


def _inverse_information(line: Linearised) -> FloatArray | None:
    """``(J^T J)^-1``, shape ``(k, k)``, or None where columns are linearly dependent."""
    jacobian = np.concatenate(line.jacobians)
    norms = np.linalg.norm(jacobian, axis=0)
    if not np.all(np.isfinite(norms)) or np.any(norms == 0.0):
        return None
    # The triangular factor has the same singular values; a tall SVD is far dearer.
    _, sizes, vt = np.linalg.svd(triangular_factor(jacobian / norms))
    rounding = jacobian.shape[0] * float(np.finfo(float).eps)
    if sizes[-1] <= (rounding if line.exact else _SINGULAR) * sizes[0]:
        return None
    half = vt.T / sizes / norms[:, np.newaxis]
    return half @ half.T


def _whitened_covariance(line: Linearised) -> FloatArray | None:
    """Covariance of (x, theta) of a fit that minimised the line's whitened residual."""
    inverse, residual = _inverse_information(line), np.concatenate(line.residuals)
    freedom = residual.size - line.jacobians[0].shape[1] - line.own
    if inverse is None or freedom < 1:
        return None
    return inverse * float(residual @ residual) / freedom


def _sandwich_covariance(line: Linearised, noise: TrialNoise) -> FloatArray | None:
    """Covariance of (x, theta) of a fit that minimised the line's plain residual.

    ``(J^T J)^-1 J^T S J (J^T J)^-1``, S the covariance of the noise in it.
    """
    inverse = _inverse_information(line)
    if inverse is None:
        return None
    meat = np.zeros_like(inverse)
    for block, own in zip(line.jacobians, noise.models, strict=True):
        covariance = own.autocovariance(block.shape[0])
        some = np.abs(covariance) > _SMALL * covariance[0]
        covariance = covariance[: np.flatnonzero(some)[-1] + 1]
        both_ways = np.append(covariance[:0:-1], covariance)[:, np.newaxis]
        meat += block.T @ _convolve(block, both_ways, mode="same", axes=0)
    return inverse @ meat @ inverse
