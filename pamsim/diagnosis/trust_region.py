"""Least squares within the unit cube, by trust-region steps, where a simulation may break down."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_least_squares: Any = scipy.optimize.least_squares

_LOST = 1e3  # factor on the residual where a simulation breaks down


@dataclass(frozen=True, kw_only=True)
class Stop:
    """Where a descent ended.

    Attributes:
        place: (p,) in the unit cube.
        cost: sum of squares there.
        slopes: (f, p) last used.
        fell: by how much the cost fell on the way.
    """

    place: FloatArray
    cost: float
    slopes: FloatArray
    fell: float = 0.0


def descend(
    residual: Callable[[FloatArray], FloatArray | None],
    slopes: Callable[[FloatArray, FloatArray], FloatArray],
    begin: FloatArray,
    *,
    most: int,
    tolerance: float,
) -> Stop | None:
    """Go down from a place.

    Args:
        residual: place (p,) to (f,), or None where the simulation breaks down.
        slopes: place and residual there to (f, p).
        begin: (p,) inside the cube.
        most: steps tried.
        tolerance: relative, of cost and place.

    Returns:
        The end, or None if the simulation breaks down at the beginning.
    """
    seen: dict[bytes, FloatArray | None] = {}

    def known(place: FloatArray) -> FloatArray | None:
        key = place.tobytes()
        if key not in seen:
            seen[key] = residual(place)
        return seen[key]

    first = known(begin)
    if first is None:
        return None
    lost = _LOST * first
    last = np.empty((first.size, 0))

    def kept(place: FloatArray) -> FloatArray:
        found = known(place)
        return lost if found is None else found

    def jacobian(place: FloatArray) -> FloatArray:
        nonlocal last
        last = slopes(place, kept(place))
        return last

    found = _least_squares(
        kept,
        begin,
        jac=jacobian,
        bounds=(0.0, 1.0),
        x_scale="jac",
        ftol=tolerance,
        xtol=tolerance,
        gtol=1e-10,
        max_nfev=most,
    )
    cost = 2.0 * float(found.cost)
    return Stop(place=found.x, cost=cost, slopes=last, fell=float(first @ first) - cost)
