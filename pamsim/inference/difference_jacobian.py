"""Jacobian by finite differences, all perturbed parameter sets simulated in one call."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from pamsim.core.units import FloatArray

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


def secant_update(known: FloatArray, step: FloatArray, change: FloatArray) -> FloatArray:
    """A Jacobian (n, p) changed by as little as makes it agree with a step (p,) and a change (n,).

    Broyden, Mathematics of Computation 19, 1965: it needs no simulation of its own.
    """
    square = float(step @ step)
    return known + np.outer(change - known @ step, step) / square if square > 0.0 else known


def secant_updated(
    compute: Callable[[FloatArray, FloatArray], FloatArray],
) -> Callable[[FloatArray, FloatArray], FloatArray]:
    """A Jacobian computed once; each further place of a descent updates it by `secant_update`.

    Place (p,) and residual there (n,) go in, the Jacobian (n, p) comes out.
    """
    last: tuple[FloatArray, FloatArray, FloatArray] | None = None

    def at(place: FloatArray, here: FloatArray) -> FloatArray:
        nonlocal last
        if last is None:
            jacobian = compute(place, here)
        else:
            before, there, known = last
            jacobian = secant_update(known, place - before, here - there)
        last = place.copy(), here.copy(), jacobian
        return jacobian

    return at
