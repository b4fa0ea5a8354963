"""Search for the optimum of a fit to trials from one start, channel noise estimated on the way.

Rows are in units of their channels' noise, priors beside them (`RowWeights`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pamsim.core.units import FloatArray
from pamsim.inference.bounded_least_squares import BreakdownError, bounded_least_squares
from pamsim.inference.difference_jacobian import BatchedResidual
from pamsim.inference.free_parameter import FreeParameter, SearchScale
from pamsim.inference.identifiability import DEAD, FLAT, determined
from pamsim.inference.noise_model import NoiseModel

_ROUNDS = 12  # of noise estimation; two or three are usual
_SETTLED = 0.01  # relative change of noise that no longer moves the optimum
_LOOSE, _TIGHT = 1e-3, 1e-8  # relative change of the cost that ends a search

NEAR, SHARP = 0.1, 1e-3
"""Standard errors from the optimum at which a search ends: one that goes on, and the last."""


class Priors:
    """Priors of parameters as m rows of a least-squares problem."""

    def __init__(self, parameters: Sequence[FreeParameter], scale: SearchScale) -> None:
        self._scale = scale
        known = [(i, p.prior) for i, p in enumerate(parameters) if p.prior is not None]
        self._which = np.array([i for i, _ in known], dtype=np.intp)
        self._mean = np.array([prior.mean for _, prior in known])
        self._spread = np.array([prior.standard_deviation for _, prior in known])

    def __call__(self, place: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals, shape (m,), and their Jacobian per range, shape (m, p)."""
        values, slope = self._scale.from_unit(place), self._scale.slope(place)
        jacobian = np.zeros((self._which.size, place.size))
        jacobian[np.arange(self._which.size), self._which] = slope[self._which] / self._spread
        return (values[self._which] - self._mean) / self._spread, jacobian


class RowWeights:
    """Cost of a fit to trials: residual rows in units of the channels' noise, and priors.

    ``first`` (n,) is the residual at the first start, where the blocks are known. A ``frozen`` cost
    keeps the noise that a search begins with.
    """

    def __init__(
        self,
        residual: BatchedResidual,
        parameters: Sequence[FreeParameter],
        first: FloatArray,
        *,
        frozen: bool = False,
    ) -> None:
        self.residual = residual
        self.noise = NoiseModel(residual.places, first)
        self.frozen = frozen or self.noise.fixed
        self.priors = Priors(parameters, residual.scale)

    def weight(self, noise: Mapping[str, float]) -> FloatArray:
        """1 / standard deviation of each row's noise, shape (n,) [1 / SI unit of the channel]."""
        return 1.0 / self.noise.deviation(noise)

    def miss(self, place: FloatArray, weight: FloatArray) -> FloatArray | None:
        """Weighted residual and priors, shape (n + m,); None where the simulation diverges."""
        residual = self.residual.at(place)
        if residual is None:
            return None
        return np.concatenate([weight * residual, self.priors(place)[0]])

    def columns(self, place: FloatArray, weight: FloatArray, jacobian: FloatArray) -> FloatArray:
        """Jacobian of `miss`, shape (n + m, p), from that of the residual per range, (n, p)."""
        return np.vstack([weight[:, np.newaxis] * jacobian, self.priors(place)[1]])

    def objective(self, place: FloatArray, noise: Mapping[str, float]) -> float:
        """-2 log likelihood up to a constant; infinite where the simulation diverges."""
        residual = self.residual.at(place)
        if residual is None:
            return np.inf
        logs = 2.0 * np.log(self.noise.deviation(noise))
        squares = (self.weight(noise) * residual) ** 2
        return float(np.sum(logs + squares) + np.sum(self.priors(place)[0] ** 2))


@dataclass(frozen=True)
class SearchState:
    """Where a search stands."""

    place: FloatArray  # in the unit cube, shape (p,)
    noise: Mapping[str, float]  # channel -> standard deviation the residuals are weighed with
    round: int = 0  # of noise estimation
    steps: int = 0  # tried so far, of the number allowed
    iterations: int = 0  # Jacobians so far


@dataclass(frozen=True)
class SearchEnd:
    """Where a search ended."""

    state: SearchState  # the last
    objective: float  # -2 log likelihood up to a constant, priors included
    converged: bool  # False if it ran out of steps


def search(
    cost: RowWeights,
    state: SearchState,
    max_steps: int,
    report_progress: Callable[[SearchState], None],
    *,
    free: NDArray[np.bool_] | None = None,
    rough: bool = False,
    arrived: float = SHARP,
) -> SearchEnd:
    """Follow one start to its end, the noise estimated again after each round.

    Args:
        cost: of the rows and priors.
        state: where to begin, at a place where the simulation does not diverge.
        max_steps: steps allowed in all.
        report_progress: called after each Jacobian.
        free: parameters to move, (p,); None for all.
        rough: True ends with the first round, near the optimum.
        arrived: standard errors from the optimum, as the Jacobian sees it, at which it ends.
    """
    moved = np.ones(state.place.size, dtype=bool) if free is None else free
    converged = not bool(np.any(moved))
    while not converged and state.steps < max_steps and state.round < _ROUNDS:
        # Weights from a start far away are rough: no use in a sharp optimum for them.
        loose = state.round == 0 and (rough or not cost.frozen)
        found = _round(
            cost,
            state,
            max_steps,
            report_progress,
            moved,
            _LOOSE if loose else _TIGHT,
            NEAR if loose else arrived,
        )
        if found is None:
            break
        state, ended = found
        residual = cost.residual.at(state.place)
        assert residual is not None
        noise = state.noise if cost.frozen else cost.noise.estimate(residual)
        settled = all(
            abs(noise[channel] - sd) <= _SETTLED * sd for channel, sd in state.noise.items()
        )
        converged = ended and (rough or (settled and not loose))
        if not settled or loose:
            state = SearchState(state.place, noise, state.round + 1, state.steps, state.iterations)
    return SearchEnd(state, cost.objective(state.place, state.noise), converged)


def _round(
    cost: RowWeights,
    state: SearchState,
    max_steps: int,
    report_progress: Callable[[SearchState], None],
    moved: NDArray[np.bool_],
    tolerance: float,
    arrived: float,
) -> tuple[SearchState, bool] | None:
    """Search with fixed noise; None if it cannot begin."""
    weight = cost.weight(state.noise)
    iterations, there = state.iterations, False

    def at(x: FloatArray) -> FloatArray:
        place = state.place.copy()
        place[moved] = x
        return place

    def jacobian(x: FloatArray, _: FloatArray) -> FloatArray:
        nonlocal iterations
        place = at(x)
        calls = cost.residual.calls
        followed = cost.residual.followed(place, weight)
        if cost.residual.calls > calls:  # else followed from the Jacobian before
            iterations += 1
            report_progress(SearchState(place, state.noise, state.round, state.steps, iterations))
        return cost.columns(place, weight, followed)[:, moved]

    def has_arrived(residual: FloatArray, columns: FloatArray) -> bool:
        nonlocal there
        there = short_of_optimum(columns, residual) < arrived
        return there

    try:
        fit = bounded_least_squares(
            lambda x: cost.miss(at(x), weight),
            [state.place[moved]],
            jacobian=jacobian,
            tolerance=tolerance,
            max_steps=max(max_steps - state.steps, 1),
            try_bounds=True,
            give_up=has_arrived,
        )
    except BreakdownError:  # the bound itself is the rim of what breaks down
        return None
    steps = state.steps + fit.steps
    return SearchState(at(fit.x), state.noise, state.round, steps, iterations), (
        there or fit.converged
    )


def short_of_optimum(jacobian: FloatArray, residual: FloatArray) -> float:
    """How far a linearisation sees its optimum, in standard errors under white noise.

    Jacobian (n, p) and residual (n,) are in units of the noise. Directions that the data leave flat
    do not count.
    """
    norms = np.linalg.norm(jacobian, axis=0)
    moving = jacobian[:, norms > DEAD * np.max(norms, initial=0.0)]
    if not moving.size:
        return 0.0
    directions = moving @ determined(moving, FLAT).basis
    seen = directions.T @ residual / np.linalg.norm(directions, axis=0)
    # Where the simulator misses more than noise, that is what blurs the optimum.
    return float(np.linalg.norm(seen)) / max(float(np.sqrt(np.mean(residual**2))), 1.0)
