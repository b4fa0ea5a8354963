"""Uniform cubic B-splines that are natural at their ends, for curves without a formula.

Control values c_k are spread evenly from one end of a curve to the other (de Boor, A Practical
Guide to Splines, 1978):

    f = sum_k c_k B(u - k),   u = (n - 1) (x - low) / (high - low),   k = -1 ... n

B is the cardinal cubic, 2/3 - |t|^2 + |t|^3 / 2 for |t| < 1 and (2 - |t|)^3 / 6 for |t| < 2. The
value more on either side lies on the straight line through the last two. At its ends the curve has
the outermost control value, and beyond them it stays at that.
"""

from __future__ import annotations

import numpy as np

from pamsim.core.units import FloatArray


def place(x: float, low: float, high: float, count: int) -> float:
    """Place u among ``count`` control values of an x, moved to the nearer end from beyond."""
    if x < low:
        x = low
    elif x > high:
        x = high
    return (count - 1) * (x - low) / (high - low)


def bump(t: float) -> float:
    """Cardinal cubic B-spline [-] at a distance t from its control value, in their spacing."""
    if t < 0.0:
        t = -t
    if t >= 2.0:
        return 0.0
    if t >= 1.0:
        rest = 2.0 - t
        return rest * rest * rest / 6.0
    return 2.0 / 3.0 - t * t + 0.5 * t * t * t


def swept_bump(t: float) -> float:
    """Integral of `bump` up to t [-]."""
    if t > 0.0:
        return 1.0 - _swept_below(-t)
    return _swept_below(t)


def _swept_below(t: float) -> float:
    if t <= -2.0:
        return 0.0
    if t <= -1.0:
        rest = 2.0 + t
        return rest * rest * rest * rest / 24.0
    return 0.5 + t * (2.0 / 3.0 - t * t * (1.0 / 3.0 + t / 8.0))


def curve_of_8(
    x: float,
    low: float,
    high: float,
    c_1: float,
    c_2: float,
    c_3: float,
    c_4: float,
    c_5: float,
    c_6: float,
    c_7: float,
    c_8: float,
) -> float:
    """Value at x of a curve with eight control values from low to high."""
    u = place(x, low, high, 8)
    value = (2.0 * c_1 - c_2) * bump(u + 1.0) + (2.0 * c_8 - c_7) * bump(u - 8.0)
    value += c_1 * bump(u) + c_2 * bump(u - 1.0) + c_3 * bump(u - 2.0) + c_4 * bump(u - 3.0)
    value += c_5 * bump(u - 4.0) + c_6 * bump(u - 5.0) + c_7 * bump(u - 6.0) + c_8 * bump(u - 7.0)
    return value


def integral_of_8(
    x: float,
    low: float,
    high: float,
    c_1: float,
    c_2: float,
    c_3: float,
    c_4: float,
    c_5: float,
    c_6: float,
    c_7: float,
    c_8: float,
) -> float:
    """Integral from low to x of a curve with eight control values from low to high."""
    if x < low:
        return c_1 * (x - low)
    u = place(x, low, high, 8)
    swept = (2.0 * c_1 - c_2) * (swept_bump(u + 1.0) - swept_bump(1.0))
    swept += c_1 * (swept_bump(u) - 0.5) + c_2 * (swept_bump(u - 1.0) - swept_bump(-1.0))
    swept += c_3 * swept_bump(u - 2.0) + c_4 * swept_bump(u - 3.0) + c_5 * swept_bump(u - 4.0)
    swept += c_6 * swept_bump(u - 5.0) + c_7 * swept_bump(u - 6.0) + c_8 * swept_bump(u - 7.0)
    swept += (2.0 * c_8 - c_7) * swept_bump(u - 8.0)
    value = swept * (high - low) / 7.0
    if x > high:
        return value + c_8 * (x - high)
    return value


def shares(x: FloatArray, low: float, high: float, count: int) -> FloatArray:
    """Weight of each of ``count`` control values in a curve at places, (n,) to (n, count) [-]."""
    u = (count - 1) * (np.clip(x, low, high) - low) / (high - low)
    t = np.abs(u[:, np.newaxis] - np.arange(-1, count + 1))
    # The same cubics: each power is cut off where it would be below 0.
    of_all = (np.maximum(2.0 - t, 0.0) ** 3 - 4.0 * np.maximum(1.0 - t, 0.0) ** 3) / 6.0
    own, first, last = of_all[:, 1:-1], of_all[:, 0], of_all[:, -1]
    own[:, 0] += 2.0 * first
    own[:, 1] -= first
    own[:, -1] += 2.0 * last
    own[:, -2] -= last
    return own
