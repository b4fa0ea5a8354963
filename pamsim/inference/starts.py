"""Where a search starts: nominal values and a Latin hypercube, off the bounds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.inference.difference_jacobian import BatchedResidual
from pamsim.inference.free_parameter import FreeParameter

_ON_BOUND = 1e-3  # of the range
_INSIDE = 0.05  # of the range: where a start on a bound is moved to
_TRIES = 3  # further sets of starts drawn where simulations diverge
_FEWEST = 8  # drawn at a time, so that they spread


def starting_places(
    residual: BatchedResidual, parameters: Sequence[FreeParameter], starts: int, seed: int
) -> list[tuple[FloatArray, FloatArray]]:
    """Find places where the simulation does not diverge.

    On a bound many parameters have no slope (friction 0, a dead zone of 0), and the search would
    stay there; a nominal value on a bound is moved inside by 5 % of the range.

    Args:
        residual: the simulator.
        parameters: p of them.
        starts: how many; the first is the nominal one, unless it diverges.
        seed: of the others.

    Returns:
        Places in the unit cube, shape (p,), each with its residual, shape (n,); fewer than
        ``starts`` if simulations diverge almost everywhere.

    Raises:
        InputError: all tried diverge.
    """
    rng = np.random.default_rng(seed)
    nominal = residual.scale.to_unit(np.array([p.start for p in parameters]))
    nominal = np.where(nominal < _ON_BOUND, _INSIDE, nominal)
    nominal = np.where(nominal > 1.0 - _ON_BOUND, 1.0 - _INSIDE, nominal)
    drawn = np.vstack([nominal, _spread(rng, starts - 1, nominal.size)])
    good: list[tuple[FloatArray, FloatArray]] = []
    tried = 0
    for _ in range(1 + _TRIES):
        tried += len(drawn)
        good += [
            (place, misfit)
            for place, misfit in zip(drawn, residual.many(drawn), strict=True)
            if misfit is not None
        ]
        if len(good) >= starts:
            return good[:starts]
        drawn = _spread(rng, max(starts - len(good), _FEWEST), nominal.size)
    if not good:
        raise InputError(
            f"the simulation diverges at all {tried} starts tried; narrow the ranges of"
            f" {', '.join(p.name for p in parameters)} or start nearer to the rig"
        )
    return good


def _spread(rng: np.random.Generator, count: int, size: int) -> FloatArray:
    return _INSIDE + (1.0 - 2.0 * _INSIDE) * latin_hypercube(rng, count, size)


def latin_hypercube(rng: np.random.Generator, count: int, size: int) -> FloatArray:
    """Latin hypercube (count, size) in the unit cube: each axis has one point in each slice.

    Source: McKay, Beckman and Conover, Technometrics 21 (1979) 239-245. scipy.stats.qmc has the
    same, but importing scipy.stats would double the time a small fit takes.
    """
    slices = np.array([rng.permutation(count) for _ in range(size)]).reshape(size, count).T
    return (slices + rng.uniform(size=(count, size))) / count
