"""Jacobian by finite differences, all perturbed parameter sets simulated in one call."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Residuals = Callable[[FloatArray], Sequence[FloatArray | None]]
"""Places, shape (k, p), to the residual of each, shape (n,); None where it cannot be computed."""


def difference_jacobian(
    residuals: Residuals,
    place: FloatArray,
    middle: FloatArray,
    step: float,
    *,
    central: bool = False,
) -> FloatArray:
    """Differentiate a residual within the unit cube.

    Steps go inward, so that no bound is crossed. A step that breaks the simulation down is tried to
    the other side, in a second call; if that breaks down too, its column is zero.

    Args:
        residuals: see `Residuals`.
        place: shape (p,), in the unit cube.
        middle: residual there, shape (n,).
        step: of the differences, as a share of the cube's edge.
        central: differences to both sides instead of one.

    Returns:
        Change of the residual per unit of each coordinate, shape (n, p).
    """
    inward = np.where(place > 0.5, -step, step)
    ahead = place + np.diag(inward)
    behind = np.clip(place - np.diag(inward), 0.0, 1.0)
    first = residuals(np.vstack([ahead, behind]) if central else ahead)
    if central:
        second = dict(enumerate(first[place.size :]))
    else:
        lost = [i for i in range(place.size) if first[i] is None]
        second = dict(zip(lost, residuals(behind[lost]), strict=True)) if lost else {}
    columns: list[FloatArray] = []
    for i in range(place.size):
        known = [(ahead[i, i], first[i]), (place[i], middle), (behind[i, i], second.get(i))]
        ends = [(at, residual) for at, residual in known if residual is not None]
        run = ends[0][0] - ends[-1][0]
        columns.append((ends[0][1] - ends[-1][1]) / run if run else np.zeros_like(middle))
    return np.stack(columns, axis=1) if columns else np.empty((middle.size, 0))


def secant_updated(
    compute: Callable[[FloatArray, FloatArray], FloatArray],
) -> Callable[[FloatArray, FloatArray], FloatArray]:
    """A Jacobian that is computed once; each further place updates it by what the step changed.

    The update of least change that agrees with the step (Broyden, Mathematics of Computation 19,
    1965): it needs no simulation of its own.

    Args:
        compute: place (p,) and residual there (n,) to the Jacobian (n, p).

    Returns:
        The same, for the places of one descent in their order.
    """
    last: tuple[FloatArray, FloatArray, FloatArray] | None = None

    def at(place: FloatArray, here: FloatArray) -> FloatArray:
        nonlocal last
        if last is None:
            jacobian = compute(place, here)
        else:
            before, there, known = last
            step = place - before
            square = float(step @ step)
            surprise = here - there - known @ step
            jacobian = known + np.outer(surprise, step) / square if square > 0.0 else known
        last = place.copy(), here.copy(), jacobian
        return jacobian

    return at
