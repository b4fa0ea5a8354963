"""Bounded nonlinear least squares from several starts, where a simulation may break down.

Every fit of the package goes through `bounded_least_squares`: a trust-region method within bounds
(`scipy.optimize.least_squares`). What a client adds is its residual, its box and its Jacobian;
coefficients that enter linearly it solves for within its residual (variable projection).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
import scipy.optimize
from numpy.typing import ArrayLike

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray

Residual = Callable[[FloatArray], FloatArray | None]
"""Place, shape (p,), to the residual there, shape (n,); None where it breaks down."""
Jacobian = Callable[[FloatArray, FloatArray], FloatArray]
"""Place, shape (p,), and residual there, shape (n,), to the Jacobian, shape (n, p)."""
GiveUp = Callable[[FloatArray, FloatArray], bool]
"""Residual (n,) and Jacobian (n, p) where a step has arrived to whether the search ends there."""

_least_squares: Any = scipy.optimize.least_squares

_INSIDE = 1e-9  # of the box: the solver wants its start strictly inside
_LOST = 1e3  # factor on the first residual where a simulation breaks down: the solver turns back
_NEAR = 1e-3  # of the box: from here a bound that attracts is tried itself
_EQUAL = 0.02  # of the tolerance: costs of starts that reached the same optimum differ by less


class BreakdownError(InputError):
    """The residual could not be computed at any start."""


class _GivenUpError(Exception):
    """A search that ends early, with what the solver would have returned."""


@dataclass(frozen=True, kw_only=True)
class Fit:
    """The best of the ends that were reached."""

    x: FloatArray  # the optimum, shape (p,)
    cost: float  # sum of squares of the residual there
    # Shape (n, p), at the optimum; just inside a bound that a coordinate was put onto
    jacobian: FloatArray
    converged: bool  # False if the search ran out of steps
    steps: int  # places tried from this start, those of finite differences not counted
    start_cost: float  # sum of squares where this start began


def bounded_least_squares(
    residual: Residual,
    starts: Sequence[FloatArray],
    *,
    lower: ArrayLike = 0.0,
    upper: ArrayLike = 1.0,
    jacobian: Jacobian | Literal["2-point", "3-point"] = "2-point",
    x_scale: ArrayLike | Literal["jac"] = "jac",
    tolerance: float = 1e-8,
    gradient_tolerance: float = 1e-12,
    max_steps: int = 100,
    follow: int | None = None,
    try_bounds: bool = False,
    give_up: GiveUp | None = None,
) -> Fit:
    """Minimise the sum of squares of a residual within a box.

    Where the residual breaks down, the search shortens its step.

    Args:
        residual: see `Residual`.
        starts: places to begin at, each of shape (p,); moved strictly inside the box.
        lower: lower bounds, shape (p,) or a number; minus infinity for none.
        upper: upper bounds, likewise.
        jacobian: a function, or a finite-difference scheme of scipy.
        x_scale: typical size of each coordinate, or ``jac`` to take it from the Jacobian.
        tolerance: relative change of cost and place that ends a search.
        gradient_tolerance: at which the cost is flat.
        max_steps: places tried from each start.
        follow: how many of the starts with the smallest cost are followed to their end; None for
            all.
        try_bounds: True puts what a bound attracts onto it, if that is no worse: the method itself
            stays inside and approaches a bound without end.
        give_up: ends a search that is not worth its time, where it is; only with a Jacobian that is
            a function.

    Returns:
        The best end. Of ends with the same cost the first counts.

    Raises:
        BreakdownError: the residual breaks down at every start.
    """
    size = len(starts[0])
    low, high = (np.broadcast_to(np.asarray(b, np.float64), size) for b in (lower, upper))
    edge = np.where(np.isfinite(high - low), high - low, 1.0)
    begins = [np.clip(start, low + _INSIDE * edge, high - _INSIDE * edge) for start in starts]
    found = [(begin, residual(begin)) for begin in begins]
    memories = [_Remembering(residual, begin, r) for begin, r in found if r is not None]
    if not memories:
        raise BreakdownError(f"the simulation breaks down at all {len(starts)} starts")
    best: Fit | None = None
    for memory in sorted(memories, key=lambda memory: memory.first_cost)[:follow]:
        begin, there = memory.last
        fit = Fit(
            x=begin,
            cost=memory.first_cost,
            jacobian=np.empty((len(there), 0)),
            converged=True,
            steps=1,
            start_cost=memory.first_cost,
        )
        if size == 0:  # which scipy takes only from 1.16 on
            return fit
        try:
            solution = _least_squares(
                memory,
                begin,
                jac=jacobian if isinstance(jacobian, str) else _watched(memory, jacobian, give_up),
                bounds=(low, high),
                method="trf",
                x_scale=x_scale,
                ftol=tolerance,
                xtol=tolerance,
                gtol=gradient_tolerance,
                max_nfev=max_steps,
            )
        except _GivenUpError as end:
            (solution,) = end.args
        fit = replace(
            fit,
            x=solution.x,
            cost=2.0 * float(solution.cost),
            jacobian=solution.jac,
            converged=bool(solution.status > 0),
            steps=int(solution.nfev),
        )
        if try_bounds:
            fit = _on_bounds(fit, memory, low, high, _NEAR * edge, solution.grad)
        if best is None or fit.cost < best.cost * (1.0 - max(_EQUAL * tolerance, 1e-9)):
            best = fit
    assert best is not None
    return best


class _Remembering:
    """A residual, its last value remembered, finite even where it breaks down."""

    def __init__(self, residual: Residual, place: FloatArray, there: FloatArray) -> None:
        self._residual = residual
        self.last = place, there
        self.first_cost = float(there @ there)
        self._lost = _LOST * np.maximum(np.abs(there), np.max(np.abs(there)))
        self.evaluations = 0

    def __call__(self, place: FloatArray) -> FloatArray:
        if not np.array_equal(place, self.last[0]):
            self.evaluations += 1
            there = self._residual(place)
            self.last = place.copy(), self._lost if there is None else there
        return self.last[1]


def _watched(
    residual: _Remembering, jacobian: Jacobian, give_up: GiveUp | None
) -> Callable[[FloatArray], FloatArray]:
    """A Jacobian as the solver calls it, which ends the search where that is given up."""

    def columns(x: FloatArray) -> FloatArray:
        here = residual(x)
        found = jacobian(x, here)
        if give_up is not None and give_up(here, found):
            raise _GivenUpError(
                scipy.optimize.OptimizeResult(
                    x=x.copy(),
                    cost=0.5 * float(here @ here),
                    jac=found,
                    grad=found.T @ here,
                    status=0,
                    nfev=residual.evaluations,
                )
            )
        return found

    return columns


def _on_bounds(
    fit: Fit,
    residual: _Remembering,
    low: FloatArray,
    high: FloatArray,
    near: FloatArray,
    gradient: FloatArray,
) -> Fit:
    """Put coordinates that a bound attracts onto it, if that is no worse."""
    to_low = (fit.x - low < near) & (gradient > 0.0)
    to_high = (high - fit.x < near) & (gradient < 0.0)
    if not np.any(to_low | to_high):
        return fit
    x = np.where(to_low, low, np.where(to_high, high, fit.x))
    there = residual(x)
    cost = float(there @ there)
    if cost > fit.cost:
        return fit
    return replace(fit, x=x, cost=cost)


def latin_hypercube(rng: np.random.Generator, count: int, size: int) -> FloatArray:
    """Latin hypercube (count, size) in the unit cube: each axis has one point in each slice.

    Source: McKay, Beckman and Conover, Technometrics 21 (1979) 239-245. scipy.stats.qmc has the
    same, but importing scipy.stats would double the time a small fit takes.
    """
    slices = np.array([rng.permutation(count) for _ in range(size)]).reshape(size, count).T
    return (slices + rng.uniform(size=(count, size))) / count
