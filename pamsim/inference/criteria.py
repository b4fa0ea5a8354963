"""Criteria by which fits of different size to the same data compete."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.inference.trial_noise import fit_trial_noise

TIE = 2.0
"""Difference below which two models are equally supported; of any criterion of this kind."""

NO_SUPPORT = 10.0
"""Difference from which the data do not support the worse model at all."""


def hannan_quinn(
    residuals: Sequence[FloatArray],
    sample_times: Sequence[float],
    unknowns: int,
    rounding: float = 0.0,
) -> float:
    """Criterion of Hannan and Quinn: of two fits the one with the smaller is preferred.

    The residuals are predicted from their own past (autoregressive noise), so that every sample
    counts, however slow the noise is. An unneeded coefficient is chosen ever more seldom as the
    record grows, as with BIC; a needed one is missed less often than with BIC.

    Args:
        residuals: of the free run, one array per trial, shape ``(n_i,)`` [output unit].
        sample_times: of each trial [s].
        unknowns: fitted numbers, those of the trials' own included.
        rounding: mean square below which a residual is only rounding [output unit^2].

    Source: Hannan and Quinn (Journal of the Royal Statistical Society B 41, 1979).
    """
    samples = sum(residual.size for residual in residuals)
    noise = fit_trial_noise(residuals, sample_times)
    least = max(rounding, float(np.finfo(float).tiny))
    surprise = sum(
        residual.size * math.log(max(own.variance, least))
        for residual, own in zip(residuals, noise.models, strict=True)
    )
    return surprise + 2.0 * math.log(math.log(samples)) * (unknowns + noise.order)


def aicc_above_best(
    squares: Sequence[float], unknowns: Sequence[float], samples: float
) -> list[float]:
    """Akaike's criterion, corrected for few samples (AICc), of each fit above the smallest.

    The correction has no value where there are no more samples than unknowns. A record of few
    independent samples can still tell a fit that misses nearly all from one that misses nearly
    nothing, so the correction is that of two samples more than the richest fit has unknowns.

    Args:
        squares: mean squared error of each fit, in one unit.
        unknowns: fitted numbers of each.
        samples: independent ones that the data are worth.

    Source: Hurvich and Tsai (Biometrika 1989).
    """
    corrected = max(samples, max(unknowns) + 2.0)
    scores = [
        samples * math.log(max(square, np.finfo(float).tiny))
        + 2.0 * k * corrected / (corrected - k - 1.0)
        for square, k in zip(squares, unknowns, strict=True)
    ]
    return [score - min(scores) for score in scores]
