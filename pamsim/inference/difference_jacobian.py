"""Residual and Jacobian of a simulator: by differences, all perturbed sets in one call."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.inference.free_parameter import FreeParameter, SearchScale
from pamsim.inference.simulator_fit import BlockPlace, Simulate, layout, stacked

_FORWARD = 1e-5  # step of the search's differences, in ranges: its error is far below the noise
_CENTRAL = 1e-4  # step at the optimum; wide enough to bridge the kinks of switching valves
_STRAIGHT = 0.2  # of a change: by how much a Jacobian may miss it and still be updated
_NO_CHANGE = 1e-6  # weighted: a change of rounding, from which nothing is learnt

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
    """Change (n, p) of a residual per unit of each coordinate, at a place (p,) of the unit cube.

    Steps, a share of the cube's edge, go inward, so that no bound is crossed. A step that breaks
    the simulation down is tried to the other side, in a second call; if that breaks down too, its
    column is zero. ``middle`` is the residual at the place, (n,); with ``central``, differences are
    to both sides.
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


@dataclass(frozen=True)
class _Linear:
    """Residual (n,) and Jacobian (n, p) at a place (p,); whether from differences there."""

    place: FloatArray
    residual: FloatArray
    jacobian: FloatArray
    differenced: bool


class BatchedResidual:
    """Residual and Jacobian over places in the unit cube (see `SearchScale`).

    Attributes:
        places: the blocks, known once a simulation has not diverged.
        evaluations: simulated parameter vectors so far.
        calls: of ``simulate`` so far.
        diverged: vectors among them that diverged.
    """

    def __init__(
        self,
        simulate: Simulate,
        parameters: Sequence[FreeParameter],
        places: tuple[BlockPlace, ...] = (),
    ) -> None:
        self._simulate = simulate
        self.scale = SearchScale(parameters)
        self.evaluations = self.calls = self.diverged = 0
        self.places = places
        self._last: tuple[FloatArray, FloatArray | None] | None = None
        self._linear: _Linear | None = None

    def many(self, at: FloatArray) -> list[FloatArray | None]:
        """Residuals (n,) at places (k, p) in the unit cube, in one call; None where it diverged.

        Raises:
            InputError: the callable returned another number of results, or blocks that differ.
        """
        answers = self._simulate(self.scale.from_unit(at))
        if len(answers) != len(at):
            raise InputError(f"{len(at)} vectors were simulated, {len(answers)} results came back")
        self.calls += 1
        self.evaluations += len(at)
        residuals: list[FloatArray | None] = []
        for blocks in answers:
            if blocks is not None and not self.places:
                self.places = layout(blocks)
            residuals.append(stacked(blocks, self.places))
        self.diverged += sum(r is None for r in residuals)
        return residuals

    def at(self, place: FloatArray) -> FloatArray | None:
        """Residual at one place, shape (n,), or None if the simulation diverged."""
        if self._linear is not None and np.array_equal(self._linear.place, place):
            return self._linear.residual
        if self._last is None or not np.array_equal(self._last[0], place):
            self._last = place.copy(), self.many(place[np.newaxis])[0]
        return self._last[1]

    def begin(
        self, place: FloatArray, residual: FloatArray, jacobian: FloatArray | None = None
    ) -> None:
        """Begin at a place (p,) whose residual (n,) is known, so that it is not simulated again.

        A Jacobian (n, p), if there is one, holds nearly, as of data that changed a little.
        """
        self._last, self._linear = (place.copy(), residual), None
        if jacobian is not None:
            self._linear = _Linear(place.copy(), residual, jacobian, differenced=False)

    def followed(self, place: FloatArray, weight: FloatArray) -> FloatArray:
        """The Jacobian (n, p) per range along a search, updated by steps that went as it had said.

        Where it missed more of a step, its rows judged by their weight (n,), differences are taken
        again. The simulation must not diverge at the place (p,).
        """
        here, known = self.at(place), self._linear
        assert here is not None
        if known is None:
            return self.jacobian(place)
        if np.array_equal(known.place, place):
            return known.jacobian
        step, change = place - known.place, here - known.residual
        missed = float(np.linalg.norm(weight * (change - known.jacobian @ step)))
        size = float(np.linalg.norm(weight * change))
        if missed > max(_STRAIGHT * size, _NO_CHANGE):
            return self.jacobian(place)
        matrix = known.jacobian
        if size > _NO_CHANGE:
            matrix = secant_update(matrix, step, change)
        self._linear = _Linear(place.copy(), here, matrix, differenced=False)
        return matrix

    def jacobian(self, place: FloatArray, *, central: bool = False) -> FloatArray:
        """Change of the residual per range, (n, p), at a place (p,) where nothing diverges.

        See `difference_jacobian`.
        """
        known = self._linear
        if not central and known and known.differenced and np.array_equal(known.place, place):
            return known.jacobian
        middle = self.at(place)
        assert middle is not None
        step = _CENTRAL if central else _FORWARD
        matrix = difference_jacobian(self.many, place, middle, step, central=central)
        self._linear = _Linear(place.copy(), middle, matrix, differenced=True)
        return matrix
