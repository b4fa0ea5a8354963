"""Three searches on one sum of squares: water cycle, differential evolution, least squares."""

# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false
# pyright: reportUnknownVariableType=false

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.optimize
from numpy.typing import ArrayLike

from pamsim.core.units import FloatArray
from pamsim.fitting.water_cycle import water_cycle
from pamsim.inference.bounded_least_squares import latin_hypercube

_least_squares: Any = scipy.optimize.least_squares
_differential_evolution: Any = scipy.optimize.differential_evolution


@dataclass(frozen=True, kw_only=True)
class SearchRun:
    """What one search reached, and how soon."""

    method: str  # ``water_cycle``, ``differential_evolution`` or ``least_squares``
    x: list[float]  # best point, shape (d,), as a list
    value: float  # cost there
    evaluations: int  # of the cost, those of finite differences included
    # Until the cost was within the tolerance of the best value any of the three reached; None
    # if it never was
    evaluations_to_tolerance: int | None


class _Counted:
    """A sum of squares that keeps each new best value and its evaluation number."""

    def __init__(self, residual: Callable[[FloatArray], FloatArray]) -> None:
        self._residual = residual
        self.count = 0
        self.best: list[tuple[int, float, FloatArray]] = []

    def residual(self, x: FloatArray) -> FloatArray:
        miss = self._residual(x)
        self.count += 1
        value = float(miss @ miss)
        if not self.best or value < self.best[-1][1]:
            self.best.append((self.count, value, np.array(x)))
        return miss

    def cost(self, x: FloatArray) -> float:
        miss = self.residual(x)
        return float(miss @ miss)


def compare_searches(
    residual: Callable[[FloatArray], FloatArray],
    low: ArrayLike,
    high: ArrayLike,
    *,
    tolerance: float,
    seed: int = 0,
    iterations: int = 200,
) -> tuple[SearchRun, ...]:
    """Run water cycle, differential evolution and least squares on one cost, evaluations counted.

    The cost is the sum of squares of a residual (m,) of a point (d,), in a box from ``low`` to
    ``high`` (d,); within the tolerance of the optimum is near enough [unit of the cost]. Least
    squares starts in the middle of the box and from eleven Latin places, the two others with
    populations of 50. Differential evolution is not polished: searches are compared, not finishes.

    Raises:
        InputError: for an empty box.
    """
    lower, upper = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
    names = ("water_cycle", "differential_evolution", "least_squares")
    water, evolution, squares = runs = [_Counted(residual) for _ in names]
    rng = np.random.default_rng(seed)
    water_cycle(water.cost, lower, upper, rng=rng, iterations=iterations)
    _differential_evolution(
        evolution.cost,
        list(zip(lower, upper, strict=True)),
        rng=np.random.default_rng(seed),
        maxiter=iterations,
        popsize=max(1, 50 // lower.size),
        tol=0.0,
        polish=False,
    )
    spread = latin_hypercube(np.random.default_rng(seed), 11, lower.size)
    for start in (np.full(lower.size, 0.5), *spread):
        _least_squares(
            squares.residual,
            lower + start * (upper - lower),
            bounds=(lower, upper),
            x_scale=upper - lower,
            ftol=1e-15,
            xtol=1e-15,
            gtol=1e-15,
        )
    optimum = min(run.best[-1][1] for run in runs)
    return tuple(
        SearchRun(
            method=name,
            x=run.best[-1][2].tolist(),
            value=run.best[-1][1],
            evaluations=run.count,
            evaluations_to_tolerance=next(
                (count for count, value, _ in run.best if value <= optimum + tolerance), None
            ),
        )
        for name, run in zip(names, runs, strict=True)
    )
