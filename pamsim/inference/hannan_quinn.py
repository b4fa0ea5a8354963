"""Criterion of Hannan and Quinn for fits whose residuals are noise, white or coloured."""

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
    """Return the criterion: of two fits to the same data that with the smaller is preferred.

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
