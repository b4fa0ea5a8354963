"""Roots and derivatives of plain functions, with types that checkers understand."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import scipy.optimize

from pamsim.core.units import FloatArray

# scipy carries no types: what it returns is Any at this file's boundary.
_brentq: Any = scipy.optimize.brentq
curve_fit: Any = scipy.optimize.curve_fit
"""`scipy.optimize.curve_fit`; with ``method="trf"`` it takes the options of ``least_squares``."""

_STEP = 1e-30


def root(function: Callable[[float], float], low: float, high: float, tolerance: float) -> float:
    """Where a function is zero (Brent's method).

    Args:
        function: of one number, with different signs at both ends.
        low: lower end.
        high: upper end.
        tolerance: of the result, in its unit.
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
