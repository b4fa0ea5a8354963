"""Bounded least squares from one start, with the channels' noise estimated on the way."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pamsim.inference.batched_residual import BatchedResidual
from pamsim.inference.bounded_least_squares import (
    BreakdownError,
    bounded_least_squares,
    one_by_one,
)
from pamsim.inference.channel_noise import NoiseModel
from pamsim.inference.free_parameter import FreeParameter

FloatArray = NDArray[np.float64]

_ROUNDS = 12  # of noise estimation; two or three are usual
_SETTLED = 0.01  # relative change of noise that no longer moves the optimum
_LOOSE, _TIGHT = 1e-3, 1e-8  # relative change of the cost that ends a search


@dataclass(frozen=True)
class SearchState:
    """Where a search stands.

    Attributes:
        place: in the unit cube, shape (p,).
        noise: channel -> standard deviation the residuals are weighed with.
        round: of noise estimation.
        steps: tried so far, of the number allowed.
        iterations: Jacobians so far.
    """

    place: FloatArray
    noise: Mapping[str, float]
    round: int = 0
    steps: int = 0
    iterations: int = 0


@dataclass(frozen=True)
class SearchEnd:
    """Where a search ended.

    Attributes:
        state: the last.
        objective: -2 log likelihood up to a constant, priors included.
        converged: False if it ran out of steps.
    """

    state: SearchState
    objective: float
    converged: bool


class LeastSquares:
    """A calibration's cost: residuals in units of noise, and priors.

    Args:
        residual: the simulator.
        parameters: p of them.
        noise: of the channels.
        weights: channel -> factor on its residuals in units of noise.
        frozen: True keeps the noise a search begins with.
        rough: True ends a search with its first round, near the optimum.
    """

    def __init__(
        self,
        residual: BatchedResidual,
        parameters: Sequence[FreeParameter],
        noise: NoiseModel,
        weights: Mapping[str, float],
        *,
        frozen: bool = False,
        rough: bool = False,
    ) -> None:
        self.residual = residual
        self.noise = noise
        self.weights = weights
        self.frozen = frozen or noise.fixed
        self._rough = rough
        self._scale = residual.scale
        known = [(i, p.prior) for i, p in enumerate(parameters) if p.prior is not None]
        self._prior = np.array([i for i, _ in known], dtype=np.intp)
        self._mean = np.array([prior.mean for _, prior in known])
        self._spread = np.array([prior.standard_deviation for _, prior in known])
        self._factor = np.concatenate(
            [
                np.full(p.block.residual.size, weights.get(p.block.channel, 1.0))
                for p in residual.places
            ]
        )

    def weight(self, noise: Mapping[str, float]) -> FloatArray:
        """Factor on each row, shape (n,) [1 / SI unit of the channel]."""
        return self._factor / self.noise.deviation(noise)

    def priors(self, place: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals of the priors, shape (m,), and their Jacobian per range, shape (m, p)."""
        values, slope = self._scale.from_unit(place), self._scale.slope(place)
        jacobian = np.zeros((self._prior.size, place.size))
        jacobian[np.arange(self._prior.size), self._prior] = slope[self._prior] / self._spread
        return (values[self._prior] - self._mean) / self._spread, jacobian

    def objective(self, place: FloatArray, noise: Mapping[str, float]) -> float:
        """-2 log likelihood up to a constant; infinite where the simulation diverges."""
        residual = self.residual.at(place)
        if residual is None:
            return np.inf
        logs = 2.0 * self._factor**2 * np.log(self.noise.deviation(noise))
        squares = (self.weight(noise) * residual) ** 2
        return float(np.sum(logs + squares) + np.sum(self.priors(place)[0] ** 2))

    def search(
        self,
        state: SearchState,
        most: int,
        told: Callable[[SearchState], None],
        *,
        free: NDArray[np.bool_] | None = None,
    ) -> SearchEnd:
        """Follow one start to its end.

        Args:
            state: where to begin, at a place where the simulation does not diverge.
            most: steps allowed in all.
            told: called after each Jacobian.
            free: parameters to move, shape (p,); None for all.

        Returns:
            The end.
        """
        moved = np.ones(state.place.size, dtype=bool) if free is None else free
        converged = not bool(np.any(moved))
        while not converged and state.steps < most and state.round < _ROUNDS:
            # Weights from a start far away are rough: no use in a sharp optimum for them.
            loose = state.round == 0 and (self._rough or not self.frozen)
            state, ended = self._round(state, most, told, moved, _LOOSE if loose else _TIGHT)
            residual = self.residual.at(state.place)
            assert residual is not None
            noise = state.noise if self.frozen else self.noise.estimate(residual)
            settled = all(
                abs(noise[channel] - sd) <= _SETTLED * sd for channel, sd in state.noise.items()
            )
            converged = ended and (self._rough or (settled and not loose))
            if not settled or loose:
                state = SearchState(
                    state.place, noise, state.round + 1, state.steps, state.iterations
                )
        return SearchEnd(state, self.objective(state.place, state.noise), converged)

    def _round(
        self,
        state: SearchState,
        most: int,
        told: Callable[[SearchState], None],
        moved: NDArray[np.bool_],
        tolerance: float,
    ) -> tuple[SearchState, bool]:
        """Search with fixed noise."""
        weight = self.weight(state.noise)
        iterations = state.iterations

        def at(x: FloatArray) -> FloatArray:
            place = state.place.copy()
            place[moved] = x
            return place

        def misfit(x: FloatArray) -> FloatArray | None:
            place = at(x)
            residual = self.residual.at(place)
            if residual is None:
                return None
            return np.concatenate([weight * residual, self.priors(place)[0]])

        def jacobian(x: FloatArray, _: FloatArray) -> FloatArray:
            nonlocal iterations
            place = at(x)
            calls = self.residual.calls
            columns = weight[:, np.newaxis] * self.residual.jacobian(place)
            if self.residual.calls > calls:  # else known from the round before
                iterations += 1
                told(SearchState(place, state.noise, state.round, state.steps, iterations))
            return np.vstack([columns, self.priors(place)[1]])[:, moved]

        try:
            fit = bounded_least_squares(
                one_by_one(misfit),
                [state.place[moved]],
                jacobian=jacobian,
                tolerance=tolerance,
                max_steps=max(most - state.steps, 1),
                try_bounds=True,
            )
        except BreakdownError:  # the bound itself is the rim of what breaks down
            return state, False
        steps = state.steps + fit.steps
        return SearchState(at(fit.x), state.noise, state.round, steps, iterations), fit.converged
