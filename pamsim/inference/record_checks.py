"""Checks on a sampled record before anything is fitted to it, each with a sentence that mends."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray

# Written time stamps are rounded (500 Hz with six decimals: 0.05 %), so exact equality is too much
# to ask; one per cent of an interval is far below what moves any time constant.
UNIFORM_TOLERANCE = 0.01

SMALLEST, LARGEST = 1e-75, 1e75  # fits sum products of four; doubles hold 1e-308 to 1e308


def finite_samples(values: ArrayLike, name: str) -> FloatArray:
    """Samples as a float64 array, shape ``(n,)``, all of it finite; ``name`` is for the error.

    Raises:
        InputError: not one-dimensional, not numbers, or a sample is NaN or infinite.
    """
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name}: not numbers ({error}); give a list or array of floats") from None
    if array.ndim != 1:
        raise InputError(f"{name}: shape {array.shape} is not (n,); give one channel at a time")
    bad = np.flatnonzero(~np.isfinite(array))
    if bad.size:
        raise InputError(
            f"{name}: {bad.size} of {array.size} samples are not finite, the first at index "
            f"{int(bad[0])}; cut or interpolate them"
        )
    return array


def increasing_time(time: ArrayLike, response: ArrayLike, minimum: int) -> tuple[FloatArray, ...]:
    """Time [s] and response as float64 arrays, shape ``(n,)`` each, time strictly increasing.

    Raises:
        InputError: lengths differ, fewer samples than ``minimum``, non-finite samples, or time does
            not increase.
    """
    t = finite_samples(time, "time")
    y = finite_samples(response, "response")
    if t.size != y.size:
        raise InputError(
            f"time has {t.size} samples but response has {y.size}; give one time per sample"
        )
    if t.size < minimum:
        raise InputError(
            f"record too short: {t.size} samples, at least {minimum} are needed; record longer"
        )
    stuck = np.flatnonzero(np.diff(t) <= 0.0)
    if stuck.size:
        i = int(stuck[0])
        raise InputError(
            f"time does not increase: time[{i + 1}] = {t[i + 1]:g} s after time[{i}] = {t[i]:g} s; "
            "sort the record and drop repeated times"
        )
    return t, y


def uniform_interval(time: FloatArray) -> float:
    """Mean sample interval [s] of a uniformly spaced, increasing time, shape ``(n,)``, n >= 2 [s].

    Raises:
        InputError: an interval differs from the mean by more than 1 %.
    """
    steps = np.diff(time)
    mean = float((time[-1] - time[0]) / (time.size - 1))
    worst = int(np.argmax(np.abs(steps - mean)))
    if abs(float(steps[worst]) - mean) > UNIFORM_TOLERANCE * mean:
        raise InputError(
            f"time is not uniform: interval {steps[worst]:g} s after time[{worst}], mean "
            f"{mean:g} s; resample to a uniform time first"
        )
    return mean


def usual_size(samples: FloatArray, name: str) -> None:
    """Refuse samples, shape ``(n,)``, of a size at which their fourth powers are no numbers.

    Raises:
        InputError: the largest is not 0 and not between `SMALLEST` and `LARGEST`.
    """
    size = float(np.max(np.abs(samples)))
    if size and not SMALLEST <= size <= LARGEST:
        raise InputError(
            f"{name} reaches {size:g}, whose powers are too large or too small to compute with;"
            " give it in another unit"
        )


def varying_output(response: FloatArray) -> None:
    """Refuse an output, shape ``(n,)``, that never moves, or whose size is not `usual_size`.

    Raises:
        InputError: all samples are equal to rounding, or too small or large.
    """
    usual_size(response, "response")
    spread = float(np.ptp(response))
    if spread <= 1e-12 * float(np.max(np.abs(response))):
        raise InputError(
            f"response is constant ({response[0]:g}) over all {response.size} samples; "
            "nothing can be identified from it, give a record in which the output moves"
        )
