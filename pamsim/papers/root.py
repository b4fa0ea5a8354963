"""The root of a function of one number, with a type that checkers understand."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import scipy.optimize

# scipy carries no types: what it returns is Any at this file's boundary.
_brentq: Any = scipy.optimize.brentq


def root(function: Callable[[float], float], low: float, high: float, tolerance: float) -> float:
    """Where a function is zero (Brent's method).

    Args:
        function: of one number, with different signs at both ends.
        low: lower end.
        high: upper end.
        tolerance: of the result, in its unit.
    """
    return float(_brentq(function, low, high, xtol=tolerance))
