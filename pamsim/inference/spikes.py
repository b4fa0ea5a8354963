"""Single wrong readings of an evenly sampled signal: found, and replaced.

A reading is wrong that neither side continues into: it lies off the line through the two samples
before it, off that through the two after it, and off the middle of its neighbours, all to the same
side and about as far. The corner of a signal at a switching valve lies on one of these lines, the
last value before a jump near one, and the top of a sharp peak below them.
"""

from __future__ import annotations

import numpy as np

from pamsim.core.units import FloatArray

_OFF = 5.0
"""Standard deviations of each distance by the noise: in a million readings one by chance."""

_SIMILAR = 0.5
"""Share of the largest distance that the smallest must be: of a jump it is none, of a wrong reading
all, but for noise and for what the signal bends."""


def without_spikes(values: FloatArray, noise: float) -> FloatArray:
    """A signal (n,) whose single wrong readings are replaced by the middle of their neighbours.

    Args:
        values: (n,) in any unit.
        noise: standard deviation from sample to sample [that unit]; 0 changes nothing.
    """
    if values.size < 5 or not noise > 0.0:
        return values
    before, last, own, following, after = (values[k : values.size - 4 + k] for k in range(5))
    middle = 0.5 * (last + following)
    off = np.stack([own - middle, own - 2.0 * last + before, own - 2.0 * following + after])
    size, one_side = np.abs(off), np.abs(np.sum(np.sign(off), axis=0)) == len(off)
    by_noise = noise * np.sqrt([[1.5], [6.0], [6.0]])
    far = np.all(size > _OFF * by_noise, axis=0) & (size.min(axis=0) > _SIMILAR * size.max(axis=0))
    wrong = one_side & far
    if not np.any(wrong):
        return values
    left = values.copy()
    left[2:-2][wrong] = middle[wrong]
    return left
