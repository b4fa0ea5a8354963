"""Fit simulator parameters to several trials by bounded least squares in units of the noise."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.inference.batched_residual import BatchedResidual
from pamsim.inference.channel_noise import NoiseModel
from pamsim.inference.fit_result import Calibration, Checkpoint, Progress
from pamsim.inference.fit_state import CalibrationState, identity
from pamsim.inference.fit_summary import verdict
from pamsim.inference.free_parameter import FreeParameter
from pamsim.inference.residual_block import Simulate
from pamsim.inference.search import LeastSquares, SearchState
from pamsim.inference.starts import starting_places

FloatArray = NDArray[np.float64]


def calibrate(
    simulate: Simulate,
    parameters: Sequence[FreeParameter],
    *,
    starts: int = 1,
    seed: int = 0,
    max_iterations: int = 100,
    weights: Mapping[str, float] | None = None,
    central: bool = True,
    rough: bool = False,
    progress: Callable[[Progress], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> Calibration:
    """Fit parameters of a simulator to what was measured.

    Every residual counts in units of its channel's noise, which is estimated on the way. The search
    is a trust-region method within the ranges (`scipy.optimize.least_squares`), from the nominal
    values and further starts; a simulation that diverges shortens its step. The same seed gives
    the same result. The simulator is called with all vectors of a Jacobian at once.

    Args:
        simulate: parameter vectors, shape (k, p) [parameter units], to the residual blocks of each.
        parameters: ranges, starts, priors.
        starts: how many to follow; the best counts, the others tell whether it is the only optimum.
        seed: of the starts.
        max_iterations: steps tried per start.
        weights: channel -> factor on its residuals in units of noise; 1 where not named.
        central: True takes central differences at the optimum, for 2 p more simulations; False
            judges from the one-sided ones of the search.
        rough: True ends each search near the optimum, with the noise estimated once: a place to
            begin a better calibration from.
        progress: told after each Jacobian.
        checkpoint: keeps finished starts and the current one; an interrupted calibration that is
            called again with it goes on from there.

    Returns:
        The calibration; read its status before its numbers.

    Raises:
        InputError: no parameters, a name twice, a weight for an unknown channel, a simulation that
            diverges everywhere, residuals whose layout changes, another calibration's checkpoint.
    """
    _check(parameters, starts, max_iterations)
    residual = BatchedResidual(simulate, parameters)
    begun = starting_places(residual, parameters, starts, seed)
    first = begun[0][1]
    noise = NoiseModel(residual.places, first)
    factors = _weights(weights, residual)
    cost = LeastSquares(residual, parameters, noise, factors, rough=rough)
    about = {
        "starts": starts,
        "seed": seed,
        "weights": factors,
        "max_iterations": max_iterations,
        "rough": rough,
    }
    state = CalibrationState(
        checkpoint, identity(residual, parameters, noise.estimate(first), about), residual
    )
    names = [p.name for p in parameters]

    def told(now: SearchState) -> None:
        state.reached(now)
        if progress is not None:
            miss = residual.at(now.place)
            assert miss is not None
            progress(
                Progress(
                    start=len(state.finished),
                    starts=len(begun),
                    iteration=now.iterations,
                    evaluations=residual.evaluations,
                    cost=float(np.mean((cost.weight(now.noise) * miss) ** 2)),
                    values=dict(
                        zip(names, residual.scale.from_unit(now.place).tolist(), strict=True)
                    ),
                )
            )

    while len(state.finished) < len(begun):
        begin = state.current
        if begin is None:
            place, miss = begun[len(state.finished)]
            residual.remember(place, miss)
            begin = SearchState(place, noise.estimate(miss))
        state.finish(cost.search(begin, max_iterations, told))
    places = [place for place, _ in begun]
    return verdict(cost, parameters, places, state.finished, central=central)


def _check(parameters: Sequence[FreeParameter], starts: int, steps: int) -> None:
    if not parameters:
        raise InputError("no parameter to calibrate; free at least one")
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
