"""Noise of several trials: those of one sample time share an autoregressive model.

The model counts samples, so that noise of one correlation time has another one at every rate.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.inference.coloured_noise import ArNoise, fit_ar_noise

_SAME = 0.01  # relative difference of two sample times that counts as none


@dataclass(frozen=True)
class TrialNoise:
    """Noise of some trials."""

    models: tuple[ArNoise, ...]  # of each trial; empty for white noise of the same variance in all

    @property
    def variance(self) -> float:
        """Of what `whiten` leaves: that of the first trial's white noise [output unit^2]."""
        return self.models[0].variance if self.models else 1.0

    @property
    def order(self) -> int:
        """Number of coefficients of all different models together."""
        return sum(model.order for model in self._different)

    @property
    def white(self) -> bool:
        """Whether whitening changes nothing."""
        return self.order == 0 and len(self._different) < 2

    @property
    def _different(self) -> tuple[ArNoise, ...]:
        return tuple(dict.fromkeys(self.models))

    def reach(self, trial: int) -> int:
        """How many rows back a row of a trial that is whitened depends on."""
        return self.models[trial].order if self.models else 0

    def whiten(self, values: FloatArray, trial: int) -> FloatArray:
        """Turn the noise of a trial into white noise, of the same variance in all trials.

        Values are a residual (n,), or the columns (n, m) of its Jacobian.
        """
        if not self.models:
            return values
        own = self.models[trial]
        return own.whiten(values) * math.sqrt(self.variance / own.variance)

    def scaled(self, factor: float) -> TrialNoise:
        """The same noise with its variances multiplied."""
        scaled = {m: replace(m, variance=m.variance * factor) for m in self._different}
        return TrialNoise(tuple(scaled[model] for model in self.models))

    def independent(self, sizes: Sequence[int]) -> float:
        """Number of independent samples in trials of these numbers of samples, one for each."""
        per_time = [model.correlation_time(1.0) for model in self.models]
        pairs = zip(sizes, per_time, strict=True)
        return sum(min(size / (2.0 * time), size) for size, time in pairs)


WHITE = TrialNoise(())


def fit_trial_noise(
    residuals: Sequence[FloatArray],
    sample_times: Sequence[float],
    absorbed: Sequence[FloatArray] = (),
    *,
    long_memory: bool = False,
) -> TrialNoise:
    """Fit a model to the residuals (n_i,) of the trials of each sample time [s].

    ``absorbed``, of each trial, and ``long_memory`` are as for
    `pamsim.inference.coloured_noise.fit_ar_noise`.
    """
    found: dict[int, ArNoise] = {}
    for group in same_rates(sample_times):
        own = fit_ar_noise(
            [residuals[i] for i in group],
            absorbed=[absorbed[i] for i in group if absorbed],
            long_memory=long_memory,
        )
        found |= dict.fromkeys(group, own)
    return TrialNoise(tuple(found[i] for i in range(len(residuals))))


def same_rates(sample_times: Sequence[float]) -> list[list[int]]:
    """Numbers of the trials of each sample time, those of the first trial first."""
    groups: list[list[int]] = []
    for i, time in enumerate(sample_times):
        for group in groups:
            if np.isclose(time, sample_times[group[0]], rtol=_SAME, atol=0.0):
                group.append(i)
                break
        else:
            groups.append([i])
    return groups
