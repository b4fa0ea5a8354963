"""Hum and single wrong readings of an evenly sampled signal: found, and taken off.

**Hum** faster than a quarter of the sampling rate, as the mains leave it, is up to 1.6 times as
large in second differences. They show noise, since what is smooth cancels in them, and take it for
white: a smoothing by them takes away some of the signal, the same in each repeat. Such a hum is a
line in the spectrum, far above the noise around it.

**A reading** is wrong that neither side continues into: it lies off the line through the two
samples before it, off that through the two after it, and off the middle of its neighbours, all to
the same side and about as far. The corner of a signal at a switching valve lies on one of these
lines, the last value before a jump near one, and the top of a sharp peak below them.

Source: R. A. Fisher, Proceedings of the Royal Society A 125 (1929) (largest ordinate of a
periodogram).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pamsim.core.units import FloatArray

_FEWEST = 64
"""Samples, from which 16 ordinates lie above a quarter of the sampling rate."""

_LINES = 5
"""That are taken off at most: the mains and their harmonics, as they are aliased."""

_LEVEL = 1e-3
"""Of the test: a signal without hum is changed once in a thousand times."""

_JUMP = 3.0
"""Robust standard deviations, beyond which second differences are left out: a valve that switches
bends the signal at one sample, which is in the spectrum everywhere."""

_FINER = np.linspace(-1.0, 1.0, 41)
"""Ordinates about the largest among which the frequency lies: in steps of a twentieth, a sinusoid
stays in phase within 5 deg to the ends of the signal."""

_OFF = 5.0
"""Standard deviations of each distance of a wrong reading: in a million readings one by chance."""

_SIMILAR = 0.5
"""Share of the largest distance that the smallest must be: of a jump it is none, of a wrong reading
all, but for noise and for what the signal bends."""


def without_hum(values: FloatArray) -> FloatArray:
    """A signal (n,) without the sinusoids above a quarter of its sampling rate that stand out."""
    left = values
    for _ in range(_LINES if values.size >= _FEWEST else 0):
        line = _line(left)
        if line is None:
            break
        left = left - line
    return left


def _line(values: FloatArray) -> FloatArray | None:
    """The largest sinusoid (n,) of a signal, or None if white noise has one as large."""
    bend = values[2:] - 2.0 * values[1:-1] + values[:-2]
    limit = _JUMP * 1.4826 * float(np.median(np.abs(bend)))  # of normal noise: median to deviation
    if not limit > 0.0:
        return None
    kept = np.abs(bend) <= limit
    bend = np.where(kept, bend, 0.0)
    ordinate = np.arange(bend.size // 4 + 1, (bend.size + 1) // 2)  # below half the sampling rate
    power = np.abs(np.fft.rfft(bend)[ordinate]) ** 2 / _gain(ordinate / bend.size) ** 2
    share = float(power.max() / power.sum())
    if ordinate.size * (1.0 - share) ** (ordinate.size - 1) > _LEVEL:
        return None
    frequencies = (ordinate[int(power.argmax())] + _FINER) / bend.size
    return max((_fitted(bend, kept, float(f)) for f in frequencies), key=lambda fit: fit[0])[1]


def _gain(frequency: FloatArray) -> FloatArray:
    """Ratio of the second difference of a sinusoid to it, negative, at cycles per sample."""
    return 2.0 * np.cos(2.0 * np.pi * frequency) - 2.0


def _fitted(
    bend: FloatArray, kept: NDArray[np.bool_], frequency: float
) -> tuple[float, FloatArray]:
    """Sum of squares of the second differences kept (n - 2,) that a sinusoid takes, and it (n,)."""
    phase = 2.0 * np.pi * frequency * np.arange(-1, bend.size + 1)
    waves = np.stack([np.cos(phase), np.sin(phase)], axis=1)
    inner = waves[1:-1][kept]
    weights = np.linalg.lstsq(inner, bend[kept], rcond=1e-6)[0]
    taken = inner @ weights
    return float(taken @ taken), waves @ (weights / _gain(np.array(frequency)))


def without_spikes(values: FloatArray, noise: float) -> FloatArray:
    """A signal (n,) whose single wrong readings are replaced by the middle of their neighbours.

    ``noise`` is the standard deviation from sample to sample in the signal's unit; 0 changes
    nothing.
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
