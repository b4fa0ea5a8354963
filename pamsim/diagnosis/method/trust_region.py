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
        residual: (f,) there.
        cost: sum of its squares.
        slopes: (f, p) last used.
        fell: by how much the cost fell on the way.
    """

    place: FloatArray
    residual: FloatArray
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
    gradient: float = 1e-10,
) -> Stop | None:
    """Go down from a place.

    Args:
        residual: place (p,) to (f,), or None where the simulation breaks down.
        slopes: place and residual there to (f, p).
        begin: (p,) inside the cube.
        most: steps tried.
        tolerance: relative, of cost and place.
        gradient: at which it is flat.

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
    lost = _LOST * np.maximum(np.abs(first), np.max(np.abs(first)))
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
        gtol=gradient,
        max_nfev=most,
    )
    cost = 2.0 * float(found.cost)
    return Stop(
        place=found.x,
        residual=kept(found.x),
        cost=cost,
        slopes=last,
        fell=float(first @ first) - cost,
    )
