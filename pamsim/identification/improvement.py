"""Test of Diebold and Mariano: whether one model's errors are really smaller than another's."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.inference.trial_noise import fit_trial_noise


def p_value_of_improvement(
    simple: Sequence[FloatArray], rich: Sequence[FloatArray], sample_times: Sequence[float]
) -> float:
    """Probability of so much smaller squared errors if both models were equally good.

    Args:
        simple: errors of one model, (n_i,) per trial.
        rich: errors of the other on the same trials.
        sample_times: of each trial [s].

    Returns:
        One-sided p-value; 1 where the errors are the same. The variance of the mean difference is
        that of correlated samples, by an autoregressive model of the differences.

    Source: Diebold and Mariano (J. Business & Economic Statistics 1995).
    """
    gains = [a**2 - b**2 for a, b in zip(simple, rich, strict=True)]
    samples = sum(gain.size for gain in gains)
    mean = sum(float(np.sum(gain)) for gain in gains) / samples
    noise = fit_trial_noise([gain - mean for gain in gains], sample_times)
    variance = sum(
        gain.size * own.variance / (1.0 - sum(own.coefficients)) ** 2
        for gain, own in zip(gains, noise.models, strict=True)
    )
    if variance <= 0.0:
        return 1.0 if mean <= 0.0 else 0.0
    return 0.5 * math.erfc(mean * samples / math.sqrt(2.0 * variance))
