"""Roots, derivatives and RMS, and what the rounding of printed numbers leaves open."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import scipy.optimize
from scipy.special import stdtrit

from pamsim.core.units import FloatArray
from pamsim.recordings.printed import Printed

# scipy carries no types: what it returns is Any at this file's boundary.
_brentq: Any = scipy.optimize.brentq
_curve_fit: Any = scipy.optimize.curve_fit

_STEP = 1e-30


def rms(values: FloatArray | Sequence[float]) -> float:
    """Root of the mean square, in the unit of the values."""
    return float(np.sqrt(np.mean(np.square(values))))


def least_squares(
    function: Callable[..., FloatArray],
    wanted: FloatArray,
    start: Sequence[float] | FloatArray,
    **options: Any,
) -> tuple[FloatArray, FloatArray]:
    """Numbers at which a function of them is nearest to (n,) wanted values.

    Beside them half their linearised 95 % intervals. The options are those of scipy's
    ``least_squares``.
    """
    options = {"method": "trf", **options}
    values, covariance = _curve_fit(lambda _, *v: function(*v), None, wanted, start, **options)
    student = stdtrit(len(wanted) - len(values), 0.975)
    return values, student * np.sqrt(np.diag(covariance))


def root(function: Callable[[float], float], low: float, high: float, tolerance: float) -> float:
    """Where a function with different signs at both ends is zero (Brent's method).

    The tolerance is that of the result, in its unit.
    """
    return float(_brentq(function, low, high, xtol=tolerance))


def derivative(function: Callable[[Any], Any], place: float) -> float:
    """Derivative by a complex step, as `jacobian`, of an analytic function of one number."""
    return float(function(complex(place, _STEP)).imag) / _STEP


def jacobian(function: Callable[[Any], Any], place: Sequence[float]) -> FloatArray:
    """Derivatives by complex steps, exact to rounding (Squire, Trapp, SIAM Review 40, 1998, 110).

    Args:
        function: analytic, of (m,) complex numbers; gives (n,) values.
        place: (m,) where to differentiate.

    Returns:
        (n, m).
    """
    steps = np.asarray(place) + 1j * _STEP * np.eye(len(place))
    return np.stack([np.imag(function(step)) for step in steps], axis=1) / _STEP


def propagated(function: Callable[..., float], *numbers: Printed) -> Printed:
    """A function of printed numbers, with how far their rounding lets it move.

    Half a unit of the result is the sum of what half a unit of each number moves it.
    """
    (result,) = propagated_each(lambda *values: [function(*values)], *numbers)
    return result


def propagated_each(
    function: Callable[..., Sequence[float]], *numbers: Printed
) -> tuple[Printed, ...]:
    """As `propagated`, for a function with several results."""
    middle = [number.value for number in numbers]
    value = np.asarray(function(*middle), dtype=np.float64)
    moved = np.zeros_like(value)
    for index, number in enumerate(numbers):
        ends = (
            function(*middle[:index], middle[index] + side * number.half_unit, *middle[index + 1 :])
            for side in (-1.0, 1.0)
        )
        moved += np.max([np.abs(np.asarray(end) - value) for end in ends], axis=0)
    return tuple(map(Printed, value.tolist(), moved.tolist()))


def half_unit(decimals: int) -> float:
    """Half a unit of the last of so many digits printed after the point."""
    return 0.5 * 10.0**-decimals
