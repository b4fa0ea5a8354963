"""Leave-one-out errors of a fit to a static table: each row by a fit that has not seen it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.inference.free_parameter import FreeParameter, SearchScale
from pamsim.inference.search import Priors
from pamsim.inference.simulator_fit import Simulate, SimulatorFit, stacked

_SETTLED = 1e-3  # change of a parameter, in units of its range, at which a refit is done
_MOST = 8  # iterations of a refit; two or three are usual


def leave_one_out(
    simulate: Simulate, parameters: Sequence[FreeParameter], fit: SimulatorFit
) -> FloatArray:
    """Predicted minus measured of each row by the fit to all others, (n,) [SI].

    Every refit is a Gauss-Newton iteration with the Jacobian of the common optimum, which is close
    to its own; all refits are simulated in one call per iteration. Rows must not be ordered in
    time.

    Raises:
        InputError: a block of a time series, fewer rows than parameters, or a refit that diverges.
    """
    linear = fit.linearisation
    for place in linear.places:
        if place.block.sample_interval is not None:
            raise InputError(
                f"trial {place.block.trial}: single samples of a record cannot be left out,"
                " because their neighbours predict them; hold out whole trials"
            )
    count = linear.residual.size
    if count <= len(parameters) + 1:
        raise InputError(f"{count} rows less one do not determine {len(parameters)} parameters")
    scale = SearchScale(parameters)
    optimum = scale.to_unit(fit.values)
    priors = Priors(parameters, scale)
    jacobian = linear.jacobian * linear.weight[:, np.newaxis]
    pull = priors(optimum)[1]

    def step(i: int, residual: FloatArray, place: FloatArray) -> FloatArray:
        keep = np.arange(count) != i
        rows = np.vstack([jacobian[keep], pull])
        miss = np.concatenate([(residual * linear.weight)[keep], priors(place)[0]])
        return np.clip(place - np.linalg.lstsq(rows, miss, rcond=None)[0], 0.0, 1.0)

    at, left = np.tile(optimum, (count, 1)), np.tile(linear.residual, (count, 1))
    for _ in range(_MOST):
        moved = np.stack([step(i, left[i], at[i]) for i in range(count)])
        change = float(np.max(np.abs(moved - at)))
        at = moved
        for i, blocks in enumerate(simulate(scale.from_unit(at))):
            residual = stacked(blocks, linear.places)
            if residual is None:
                raise InputError(
                    f"without row {i + 1} the fit leaves the range that can be simulated"
                )
            left[i] = residual
        if change < _SETTLED:
            break
    return np.diag(left).copy()
