"""Fit percent: how much of the measured variation a simulated output explains."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pamsim.core.errors import InputError
from pamsim.inference.record_checks import finite_samples, varying_output


def fit_percent(measured: ArrayLike, simulated: ArrayLike) -> float:
    """Return the normalised root-mean-square fit ``100 (1 - |y - yhat| / |y - mean(y)|)``.

    100 is a perfect match, 0 is no better than the mean of the data, negative is worse than it.
    A simulation that left the finite numbers (an unstable model) gives minus infinity.

    Source: definition used by MATLAB ``compare`` (System Identification Toolbox, NRMSE fit).
    """
    y = finite_samples(measured, "measured")
    yhat = np.asarray(simulated, dtype=np.float64)
    if y.size == 0 or y.shape != yhat.shape:
        raise InputError(
            f"measured has shape {y.shape}, simulated {yhat.shape}; "
            "give two non-empty series of one length"
        )
    varying_output(y)
    if not np.all(np.isfinite(yhat)):
        return float("-inf")
    # A huge but finite simulation may overflow in the norm: that, too, is minus infinity.
    with np.errstate(over="ignore"):
        miss = float(np.linalg.norm(y - yhat))
    return 100.0 * (1.0 - miss / float(np.linalg.norm(y - np.mean(y))))
