"""Noise of a sampled signal from the signal alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_SECOND_DIFFERENCE = np.sqrt(6.0)  # of white noise, in its standard deviations
_MEDIAN_TO_SD = 1.4826


def rough_noise(signal: FloatArray, lag: int = 1) -> float:
    """Standard deviation of the noise on a signal, over a lag in samples.

    From second differences, in which what is smooth over the lag all but cancels, by their median,
    which the few samples at a switching valve do not move.

    Args:
        signal: (n,) evenly sampled, in any unit.
        lag: [samples]; noise that drifts more slowly than this is not seen.

    Returns:
        Standard deviation [unit of the signal]; 0 for fewer than 2 lag + 1 samples.
    """
    bend = signal[2 * lag :] - 2.0 * signal[lag:-lag] + signal[: -2 * lag]
    return _MEDIAN_TO_SD * float(np.median(np.abs(bend))) / _SECOND_DIFFERENCE if len(bend) else 0.0
