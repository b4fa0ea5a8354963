"""Noise of a sampled signal from the signal alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_SECOND_DIFFERENCE = np.sqrt(6.0)  # of white noise, in its standard deviations
_MEDIAN_TO_SD = 1.4826


def rough_noise(*signals: FloatArray, lag: int = 1) -> float:
    """Standard deviation of the noise of signals that share it, over a lag in samples.

    From second differences, in which what is smooth over the lag all but cancels, by their median,
    which the few samples at a switching valve do not move.

    Args:
        signals: (n,) each, evenly sampled, in any unit.
        lag: [samples]; noise that drifts more slowly than this is not seen.

    Returns:
        Standard deviation [unit of the signal]; 0 for fewer than 2 lag + 1 samples.
    """
    bends = [s[2 * lag :] - 2.0 * s[lag:-lag] + s[: -2 * lag] for s in signals]
    bend = np.abs(np.concatenate(bends))
    return _MEDIAN_TO_SD * float(np.median(bend)) / _SECOND_DIFFERENCE if len(bend) else 0.0
