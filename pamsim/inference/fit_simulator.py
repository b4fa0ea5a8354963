"""Fit simulator parameters to several trials by bounded least squares in units of the noise."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.inference.batched_residual import BatchedResidual
from pamsim.inference.fit_checkpoint import FitState, identity
from pamsim.inference.fit_summary import summarise_fit
from pamsim.inference.free_parameter import FreeParameter
from pamsim.inference.noise_model import NoiseModel
from pamsim.inference.residual_block import Simulate
from pamsim.inference.row_weights import RowWeights
from pamsim.inference.search import SearchState, search
from pamsim.inference.simulator_fit import Checkpoint, SearchProgress, SimulatorFit
from pamsim.inference.starts import starting_places

FloatArray = NDArray[np.float64]


def fit_simulator(
    simulate: Simulate,
    parameters: Sequence[FreeParameter],
    *,
    starts: int = 1,
    seed: int = 0,
    max_iterations: int = 100,
    weights: Mapping[str, float] | None = None,
    central: bool = True,
    rough: bool = False,
    progress: Callable[[SearchProgress], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> SimulatorFit:
    """Fit parameters of a simulator to what was measured.

    Every residual counts in units of its channel's noise, which is estimated on the way. The search
    is a trust-region method within the ranges (`bounded_least_squares`), from the nominal values
    and further starts; a simulation that diverges shortens its step. The same seed gives the same
    result. The simulator is called with all vectors of a Jacobian at once.

    Args:
        simulate: parameter vectors, shape (k, p) [parameter units], to the residual blocks of each.
        parameters: ranges, starts, priors.
        starts: how many to follow; the best counts, the others show whether it is the only optimum.
        seed: of the starts.
        max_iterations: steps tried per start.
        weights: channel -> factor on its residuals in units of noise; 1 where not named.
        central: True takes central differences at the optimum, for 2 p more simulations; False
            judges from the one-sided ones of the search.
        rough: True ends each search near the optimum, with the noise estimated once: a place to
            begin a better fit from.
        progress: called after each Jacobian.
        checkpoint: keeps finished starts and the current one; an interrupted fit that is called
            again with it goes on from there.

    Returns:
        The fit; read its status before its numbers.

    Raises:
        InputError: no parameters, a name twice, a weight for an unknown channel, a simulation that
            diverges everywhere, residuals whose layout changes, another fit's checkpoint.
    """
    _check(parameters, starts, max_iterations)
    residual = BatchedResidual(simulate, parameters)
    starting = starting_places(residual, parameters, starts, seed)
    first = starting[0][1]
    noise = NoiseModel(residual.places, first)
    factors = _weights(weights, residual)
    cost = RowWeights(residual, parameters, noise, factors)
    about = {
        "starts": starts,
        "seed": seed,
        "weights": factors,
        "max_iterations": max_iterations,
        "rough": rough,
    }
    state = FitState(
        checkpoint, identity(residual, parameters, noise.estimate(first), about), residual
    )
    names = [p.name for p in parameters]

    def note(now: SearchState) -> None:
        state.reached(now)
        if progress is not None:
            miss = residual.at(now.place)
            assert miss is not None
            progress(
                SearchProgress(
                    start=len(state.finished),
                    starts=len(starting),
                    iteration=now.iterations,
                    evaluations=residual.evaluations,
                    cost=float(np.mean((cost.weight(now.noise) * miss) ** 2)),
                    values=dict(
                        zip(names, residual.scale.from_unit(now.place).tolist(), strict=True)
                    ),
                )
            )

    while len(state.finished) < len(starting):
        begin = state.current
        if begin is None:
            place, miss = starting[len(state.finished)]
            residual.remember(place, miss)
            begin = SearchState(place, noise.estimate(miss))
        state.finish(search(cost, begin, max_iterations, note, rough=rough))
    places = [place for place, _ in starting]
    return summarise_fit(cost, parameters, places, state.finished, central=central)


def _check(parameters: Sequence[FreeParameter], starts: int, steps: int) -> None:
    if not parameters:
        raise InputError("no parameter to fit; free at least one")
    names = [p.name for p in parameters]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(f"parameter {twice[0]!r} is given twice")
    if starts < 1 or steps < 1:
        raise InputError(f"{starts} starts of {steps} steps: at least one of each is needed")


def _weights(weights: Mapping[str, float] | None, residual: BatchedResidual) -> dict[str, float]:
    channels = sorted({p.block.channel for p in residual.places})
    for channel, factor in (weights or {}).items():
        if channel not in channels:
            raise InputError(
                f"weight for unknown channel {channel!r}; known: {', '.join(channels)}"
            )
        if not (np.isfinite(factor) and factor >= 0.0):
            raise InputError(f"weight {factor!r} of channel {channel} is not a number from 0 on")
    return {channel: float((weights or {}).get(channel, 1.0)) for channel in channels}
