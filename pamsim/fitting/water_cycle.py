"""The water cycle algorithm, as Nguyen 2024 used it (its Table 1), beside two other searches.

Eskandar, Sadollah, Bahreininejad, Hamdi: Water cycle algorithm, Computers & Structures 110-111
(2012) 151-166. Raindrops are random points; the best is the sea, the next few are rivers, the rest
streams shared among them. Streams flow towards their river, rivers towards the sea, and whoever
finds a better place takes the higher rank. A river that comes too near the sea evaporates and rains
down anywhere; a stream of the sea that does so rains down near the sea.

Where the prints leave a choice, it is made as follows. All variables are scaled to [0, 1], so that
d_max and mu are shares of the box. Table 1's share of streams, |fit_n - fit_(Nriver+2)| over a sum
of fits, is normalised by the sum of the same differences, or the shares would not add up (so
Sadollah et al., Applied Soft Computing 30 (2015) 58-71). Its C is Eskandar's constant 2 unless
``shrinking``, which takes the table's 2 (1 - i/i_max)^2 (restored: the print has lost its
operators). Rain after step 7 falls anywhere (Eskandar's (9)); Table 1 prints the formula of step 8
for both.

Which to use: not this one where least squares applies. The cost it was used for (Nguyen 2024, (16))
is a smooth sum of squares. Least squares from a dozen starts (`compare_searches`) comes within
0.001 N^2 of its optimum after 25 to 550 evaluations, differential evolution after 2000 to 3500, the
water cycle after 10000 at best and mostly not at all; and only least squares leaves the Jacobian
that intervals are made of. Worse, for loops made from the published alpha, beta and Ke the cost has
a second minimum, 50 to 90 N^2 at the edge of the box (beta as short as allowed), beside the true
one, 0, at the end of a narrow curved valley: in all but narrow boxes both population searches end
at the edge nearly always. Where a cost has no slope, use differential evolution.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.optimize
from numpy.typing import ArrayLike, NDArray

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.inference.bounded_least_squares import latin_hypercube

_NEAR = 1e-3  # d_max at the start, share of the box
_RAIN = 0.1  # mu of Eskandar's (10), variance of the rain near the sea, box units squared


class WaterCycleResult(NamedTuple):
    """Where the sea ended: the best point (d,), and the cost there."""

    x: FloatArray
    value: float


def water_cycle(
    cost: Callable[[FloatArray], float],
    low: ArrayLike,
    high: ArrayLike,
    *,
    rng: np.random.Generator,
    population: int = 50,
    rivers: int = 3,
    iterations: int = 200,
    shrinking: bool = False,
) -> WaterCycleResult:
    """Minimise a finite cost of a point (d,) in a box from ``low`` to ``high`` (d,).

    Args:
        cost: of a point.
        low: lower corner.
        high: upper corner.
        rng: where the randomness comes from: the same state gives the same result.
        population: N_pop, all raindrops.
        rivers: N_river.
        iterations: at most; every one costs about ``population`` evaluations.
        shrinking: whether C falls to 0 as in Table 1 of Nguyen 2024, or stays 2.

    Raises:
        InputError: for an empty box, or fewer streams than seas and rivers.
    """
    lower, upper = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
    if lower.shape != upper.shape or lower.ndim != 1 or not np.all(lower < upper):
        raise InputError("water cycle: the box is empty; give low < high for every variable")
    heads = rivers + 1
    if rivers < 1 or population < 2 * heads:
        raise InputError(
            f"water cycle: {population} raindrops are too few for a sea and {rivers} rivers;"
            f" give at least {2 * heads} and a river"
        )

    def at(u: FloatArray) -> float:
        return float(cost(lower + u * (upper - lower)))

    # Steps 2 and 3. Row 0 is the sea, rows 1 to `rivers` the rivers, the rest streams.
    place = rng.uniform(size=(population, lower.size))
    value = np.array([at(u) for u in place])
    order = np.argsort(value, kind="stable")
    place, value = place[order], value[order]
    target = _shares(value, heads)
    near = _NEAR
    for iteration in range(iterations):
        reach = 2.0 * (1.0 - iteration / iterations) ** 2 if shrinking else 2.0
        # Steps 5 and 6. Streams first, then rivers, each towards what it belongs to.
        for i in [*range(heads, population), *range(1, heads)]:
            goal = int(target[i])
            step = rng.uniform(size=lower.size) * reach * (place[goal] - place[i])
            place[i] = np.clip(place[i] + step, 0.0, 1.0)
            value[i] = at(place[i])
            if value[i] < value[goal]:
                _exchange(place, value, i, goal)
            if goal != 0 and value[goal] < value[0]:
                _exchange(place, value, goal, 0)
        # Steps 7 and 8: evaporation and rain.
        for i in range(1, population):
            if target[i] != 0 or np.linalg.norm(place[0] - place[i]) >= near:
                continue
            if i < heads:
                place[i] = rng.uniform(size=lower.size)
            else:
                rain = place[0] + np.sqrt(_RAIN) * rng.standard_normal(lower.size)
                place[i] = np.clip(rain, 0.0, 1.0)
            value[i] = at(place[i])
            if value[i] < value[0]:
                _exchange(place, value, i, 0)
        near -= near / iterations  # step 9
    return WaterCycleResult(lower + place[0] * (upper - lower), float(value[0]))


def _shares(value: FloatArray, heads: int) -> NDArray[np.intp]:
    """Step 4: the row each raindrop flows to; the sea and better rivers have more streams."""
    streams = value.size - heads
    lead = np.abs(value[:heads] - value[heads])
    # Equal costs (a flat place) share equally.
    share = lead / np.sum(lead) if np.sum(lead) > 0.0 else np.full(heads, 1.0 / heads)
    count = np.maximum(np.round(share * streams), 1).astype(int)
    while np.sum(count) != streams:  # rounding may lose or add a stream: the largest settles it
        count[int(np.argmax(count))] += 1 if np.sum(count) < streams else -1
    flow = np.repeat(np.arange(heads), count)
    return np.concatenate([np.zeros(heads, dtype=np.intp), flow])


def _exchange(place: FloatArray, value: FloatArray, i: int, j: int) -> None:
    place[[i, j]] = place[[j, i]]
    value[[i, j]] = value[[j, i]]


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
    scipy.optimize.differential_evolution(
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
        scipy.optimize.least_squares(
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
