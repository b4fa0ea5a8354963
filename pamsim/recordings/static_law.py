"""Arctangent law of a muscle's length over pressure: no memory, no rate.

y = a0 arctan(a1 x + a2) + a3, one branch of the loop (Alraouf 2025, equations (1) and (2); its
"b0 +" read as "b0").
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


def arctangent_law(x: ArrayLike, a0: float, a1: float, a2: float, a3: float) -> FloatArray:
    """One branch of the arctangent loop (Alraouf 2025, equations (1) and (2)).

    Args:
        x: (n,) pressure [unit of 1/a1].
        a0: half-height over pi/2 [unit of y].
        a1: steepness [1 / unit of x].
        a2: shift [-].
        a3: value in the middle [unit of y].

    Returns:
        (n,) y.
    """
    return a0 * np.arctan(a1 * np.asarray(x, dtype=np.float64) + a2) + a3
