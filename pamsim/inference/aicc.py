"""Akaike's information criterion, corrected for few samples (AICc), of fits to the same data."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np


def aicc_above_best(
    squares: Sequence[float], unknowns: Sequence[float], samples: float
) -> list[float]:
    """AICc of each fit above the smallest.

    The correction has no value where there are no more samples than unknowns. A record of few
    independent samples can still tell a fit that misses nearly all from one that misses nearly
    nothing, so the correction is that of two samples more than the richest fit has unknowns.

    Args:
        squares: mean squared error of each fit, in one unit.
        unknowns: fitted numbers of each.
        samples: independent ones that the data are worth.

    Returns:
        One for each fit, 0 for the best.

    Source: Hurvich and Tsai (Biometrika 1989).
    """
    corrected = max(samples, max(unknowns) + 2.0)
    scores = [
        samples * math.log(max(square, np.finfo(float).tiny))
        + 2.0 * k * corrected / (corrected - k - 1.0)
        for square, k in zip(squares, unknowns, strict=True)
    ]
    return [score - min(scores) for score in scores]
