"""Starting points that cover a box evenly along every axis."""

from __future__ import annotations

import numpy as np

from pamsim.core.units import FloatArray


def latin_hypercube(rng: np.random.Generator, count: int, size: int) -> FloatArray:
    """Latin hypercube in the unit cube: each axis has one point in each of ``count`` slices.

    Args:
        rng: where the randomness comes from.
        count: points.
        size: dimensions; 0 is allowed.

    Returns:
        Points, shape (count, size), in [0, 1).

    Source: McKay, Beckman and Conover, Technometrics 21 (1979) 239-245. scipy.stats.qmc has the
    same, but importing scipy.stats would double the time a small fit takes.
    """
    slices = np.array([rng.permutation(count) for _ in range(size)]).reshape(size, count).T
    return (slices + rng.uniform(size=(count, size))) / count
