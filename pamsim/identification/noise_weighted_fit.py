"""A fit whose intervals hold under coloured noise: noise model, weighted refit, and which to keep.

With the right structure, whitening by the noise model gives the most precise estimates, and
intervals at the stated coverage. With a wrong one (hysteresis, a missing lag) the residuals contain
the model's own error, and whitening gives a model that predicts one step well and simulates badly.
So the weighted estimates are kept only if they lie within the uncertainty of the unweighted ones,
and do not simulate much worse: where that uncertainty is large, nearly everything lies within it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.special

from pamsim.core.units import FloatArray
from pamsim.identification.optimum import Optimum, student_quantile
from pamsim.identification.separable_fit import (
    Separable,
    Solution,
    linearise,
    minimise,
    noise_of_fit,
    sandwich_covariance,
    whitened_covariance,
)
from pamsim.inference.coloured_noise import ArNoise
from pamsim.inference.trial_noise import WHITE, TrialNoise, fit_trial_noise

_chi2_tail: Any = scipy.special.chdtrc

_ROUNDS = 4
_SETTLED = 0.02  # change between rounds, in standard errors
_DISAGREE = 0.01  # p-value below which the weighted estimates are rejected
_MUCH_WORSE = 1.5  # RMS error of the free run over the unweighted one's
_FEWEST = 4.0
"""Degrees of freedom at least, where noise is so slow that a record holds few independent samples:
most of such noise is in the offset and start that each trial has of its own."""
_PERFECT = 1e-9  # residual over output, RMS: below it there is only rounding


@dataclass(frozen=True, eq=False)
class NoiseWeightedFit:
    """Estimates with a covariance that holds under coloured noise.

    Attributes:
        solution: the optimum that is kept.
        covariance: of (x, theta); None if the data do not determine them.
        noise: of the residuals.
        weighted: whether the kept optimum minimises the whitened residual.
        disagreement: p-value of weighted against unweighted estimates; None if not weighted.
        quantile: of Student's t, for 95 % intervals [-].
    """

    solution: Solution
    covariance: FloatArray | None
    noise: TrialNoise
    weighted: bool
    disagreement: float | None
    quantile: float

    @property
    def optimum(self) -> Optimum:
        """Of x and theta."""
        return Optimum(self.solution.coordinates, self.covariance, self.quantile)


def noise_weighted_fit(problem: Separable, starts: Sequence[FloatArray]) -> NoiseWeightedFit:
    """Fit plainly, model the residuals, refit whitened, keep the better supported estimates."""
    plain = minimise(problem, starts)
    line = linearise(problem, plain.x, plain.theta, WHITE)
    sizes = [output.size for output in problem.outputs]
    total = sum(sizes)
    free = plain.x.size + plain.theta.size + line.own
    freedom = max(total - free, 1)

    def fitted(
        solution: Solution,
        covariance: FloatArray | None,
        noise: TrialNoise,
        disagreement: float | None = None,
        *,
        weighted: bool = False,
    ) -> NoiseWeightedFit:
        # Noise is known by its independent samples, however densely it is sampled.
        known = max(noise.independent(sizes) - free, _FEWEST)
        quantile = student_quantile(known)
        return NoiseWeightedFit(solution, covariance, noise, weighted, disagreement, quantile)

    moves = sum(float(np.sum((y - np.mean(y)) ** 2)) for y in problem.outputs)
    if plain.cost <= _PERFECT**2 * moves:
        noise = TrialNoise((ArNoise((), plain.cost / freedom),) * len(problem.outputs))
        return fitted(plain, whitened_covariance(line), noise)
    noise = fit_trial_noise(line.residuals, problem.sample_times)
    robust = sandwich_covariance(line, noise.scaled(total / freedom))
    if noise.white or robust is None:
        return fitted(plain, whitened_covariance(line), noise)
    evaluations = plain.evaluations
    kept, covariance = plain, robust
    for rounds in range(_ROUNDS):
        better = minimise(problem, [kept.x], noise)
        evaluations += better.evaluations
        line = linearise(problem, better.x, better.theta, noise)
        latest = whitened_covariance(line)
        if latest is None or not better.settled:
            return fitted(plain, robust, noise)
        change = np.append(better.x - kept.x, better.theta - kept.theta)
        kept, covariance = better, latest
        if rounds and np.max(np.abs(change) / np.sqrt(np.diag(latest))) < _SETTLED:
            break
        noise = noise_of_fit(line, latest)
    moved = np.append(kept.x - plain.x, kept.theta - plain.theta)
    distance = float(moved @ np.linalg.lstsq(robust, moved, rcond=None)[0])
    p_value = float(_chi2_tail(moved.size, max(distance, 0.0)))
    free_run = np.concatenate(linearise(problem, kept.x, kept.theta, WHITE).residuals)
    much_worse = float(free_run @ free_run) > _MUCH_WORSE**2 * plain.cost
    if p_value < _DISAGREE or much_worse:
        plain = replace(plain, evaluations=evaluations)
        first = linearise(problem, plain.x, plain.theta, WHITE).residuals
        noise = fit_trial_noise(first, problem.sample_times)
        return fitted(plain, robust, noise, p_value)
    kept = replace(kept, evaluations=evaluations)
    return fitted(kept, covariance, noise, p_value, weighted=True)
