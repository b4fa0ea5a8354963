"""The clock of a second logger beside that of a first, by a signal that both have recorded."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import OptimizeResult, least_squares
from scipy.signal import correlate, find_peaks

from pamsim.comparison.link_inputs import smoothed
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.inference.estimate import NORMAL95
from pamsim.inference.trial_noise import fit_trial_noise
from pamsim.recordings.recording_checks import FEWEST_ROWS

_OVERLAP = 0.2
"""Least share of the shorter log in which both must have recorded: less correlates by chance."""
_RELATED = 0.7
"""Least correlation of the two records of a signal: half of the variance is then shared."""
_UNLIKELY = 4.6
"""Difference of log-likelihoods from which another offset is excluded: 100 to 1."""
_MOST = 10_000
"""Samples that a record is thinned to, by means of neighbours: a second of computing."""
_GAPS = 20.0
"""Longest even grid of a record, in multiples of its samples: it must fit into memory."""
_QUARTZ = 1e-4
"""Standard deviation of the rates of two clocks before their logs are seen: quartz is off by 20 to
100 ppm."""
_FASTEST = 10.0 * _QUARTZ
"""By which two clocks may differ at most."""


@dataclass(frozen=True, kw_only=True)
class ClockFit:
    """Time of a first clock = ``offset`` + ``rate`` x time of a second."""

    offset: float  # [s]
    offset_error: float  # half width of its 95 % interval [s]
    rate: float = 1.0  # seconds of the first in one of the second
    rate_error: float = 0.0  # half width of its 95 % interval
    correlation: float = 1.0  # of the two records of the signal on the common clock


def fit_clock(
    time: FloatArray, signal: FloatArray, other: FloatArray, seen: FloatArray
) -> ClockFit:
    """Find a second clock by a signal that both loggers have recorded, in any units and signs.

    The offset of the largest correlation is refined by least squares, together with the rate of
    the second clock, near 1 as clocks are, and with gain and zero of its record. Intervals allow
    for residuals that resemble their neighbours.

    Args:
        time: of the first clock, increasing, (n,) [s].
        signal: then, (n,).
        other: of the second clock, increasing, (m,) [s].
        seen: the signal as the second logger has it then, (m,).

    Raises:
        InputError: if a record stands still or is mostly gaps, if they do not resemble each other,
            or if several offsets fit equally well, as those of a signal that repeats.
    """
    for values in (signal, seen):
        if np.ptp(values) == 0.0:
            raise InputError("stands still in one of the logs: share a signal that changes")
    time, signal = _thinned(time, signal)
    other, seen = _thinned(other, seen)
    start, rivals = _offsets(time, signal, other, seen)
    # Noise makes a record steeper, and the offset would look better known than it is.
    first = CubicSpline(time, smoothed(time, signal))
    found, independent = _refined(first, time, other, seen, start)
    if abs(found.correlation) < _RELATED:
        raise InputError(
            f"correlates by {abs(found.correlation):.2f} at best: the logs share no such signal, or"
            " never recorded at the same time"
        )
    for rival in rivals:
        again, _ = _refined(first, time, other, seen, rival)
        left = [max(1.0 - one.correlation**2, 1e-12) for one in (found, again)]
        if 0.5 * independent * math.log(left[1] / left[0]) < _UNLIKELY:
            raise InputError(
                f"fits an offset of {found.offset:.4g} s as well as {again.offset:.4g} s;"
                " record something that happens once, or state `offset`"
            )
    return found


def _thinned(time: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    each = -(-time.size // _MOST)
    whole = time.size // each * each
    return tuple(x[:whole].reshape(-1, each).mean(axis=1) for x in (time, values))


def _offsets(
    time: FloatArray, signal: FloatArray, other: FloatArray, seen: FloatArray
) -> tuple[float, list[float]]:
    """The offset [s] of the largest correlation on an even grid, and those of other peaks."""
    step = max(float(np.median(np.diff(time))), float(np.median(np.diff(other))))
    if any(np.ptp(t) > _GAPS * t.size * step for t in (time, other)):
        raise InputError("has gaps that are longer than all that was recorded; cut the log")
    grids = [np.arange(t[0], t[-1], step) for t in (time, other)]
    a = np.interp(grids[0], time, signal)
    b = np.interp(grids[1], other, seen)
    a, b = (a - a.mean()) / a.std(), (b - b.mean()) / b.std()
    ones = np.ones_like(a), np.ones_like(b)
    count = np.round(correlate(*ones))
    sums = correlate(a, ones[1]), correlate(ones[0], b)
    squares = correlate(a * a, ones[1]), correlate(ones[0], b * b)
    spread = np.prod(
        [np.maximum(q * count - s * s, 0.0) for q, s in zip(squares, sums, strict=True)], axis=0
    )
    like = np.abs(correlate(a, b) * count - sums[0] * sums[1])
    enough = (count >= max(3.0, _OVERLAP * min(a.size, b.size))) & (spread > 0.0)
    like = np.where(enough, like / np.sqrt(np.where(enough, spread, 1.0)), 0.0)
    # Index k of the full correlation lays b's first sample on a's number k - (b.size - 1).
    lags = (np.arange(like.size) - (b.size - 1)) * step + grids[0][0] - grids[1][0]
    best = int(np.argmax(like))
    peaks, _ = find_peaks(like, height=_RELATED * like[best])
    near = sorted((k for k in peaks if k != best), key=lambda k: -like[k])[:3]
    return float(lags[best]), [float(lags[k]) for k in near]


def _refined(
    first: CubicSpline, time: FloatArray, other: FloatArray, seen: FloatArray, start: float
) -> tuple[ClockFit, float]:
    """Offset and rate by least squares from a start [s], and how many samples are independent."""
    step = float(np.median(np.diff(other)))
    margin = 2.0 * step + _FASTEST * float(np.ptp(other))
    inside = (start + other >= time[0] + margin) & (start + other <= time[-1] - margin)
    if np.count_nonzero(inside) < FEWEST_ROWS:
        raise InputError(f"was recorded by both in fewer than {FEWEST_ROWS} rows; let them overlap")
    at, values = other[inside], seen[inside]
    middle, length = float(at.mean()), float(np.ptp(at))

    def missed(found: FloatArray) -> FloatArray:
        # The second number is by how much the clocks part over the log: both are seconds.
        signal = first(start + found[0] + at + found[1] * (at - middle) / length)
        design = np.column_stack([signal, np.ones(at.size)])
        return values - design @ np.linalg.lstsq(design, values, rcond=None)[0]

    most = np.array([4.0 * step, _FASTEST * length])

    def fitted(noise: float) -> tuple[OptimizeResult, FloatArray]:
        def weighed(found: FloatArray) -> FloatArray:
            return np.append(missed(found) / noise, found[1] / length / _QUARTZ)

        fit = least_squares(weighed, [0.0, 0.0], bounds=(-most, most), x_scale=most)
        return fit, missed(fit.x)

    # The first is to know how large what is left is: the prior of the rate is weighed against it.
    _, left = fitted(float(values.std()))
    independent = fit_trial_noise([left], [step]).independent([left.size])
    fit, left = fitted(math.sqrt(float(left @ left) / max(independent - 4.0, 1.0)))
    errors = NORMAL95 * np.sqrt(np.diag(np.linalg.pinv(fit.jac.T @ fit.jac)))
    rate, rate_error = float(fit.x[1]) / length, float(errors[1]) / length
    share = float(left @ left) / float(np.sum((values - values.mean()) ** 2))
    clock = ClockFit(
        offset=start + float(fit.x[0]) - rate * middle,
        offset_error=math.hypot(float(errors[0]), rate_error * middle),
        rate=1.0 + rate,
        rate_error=rate_error,
        correlation=math.sqrt(max(1.0 - share, 0.0)),
    )
    return clock, independent
