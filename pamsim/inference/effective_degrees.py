"""Degrees of freedom of a variance that is a sum of estimated variances."""

from __future__ import annotations

import numpy as np

from pamsim.core.units import FloatArray

_MANY = 1e6  # beyond which Student's t is normal


def effective_degrees(variances: FloatArray, degrees: FloatArray) -> FloatArray:
    """Degrees of freedom of sums of independent variances (Satterthwaite, Biometrics 2, 1946).

    Where one variance is most of a sum, so are its degrees of freedom, however many the others
    have.

    Args:
        variances: (k, ...) of k parts.
        degrees: (k,) of freedom of each.

    Returns:
        Shape (...); where all variances are 0, as many as there can be.
    """
    along = degrees.reshape(-1, *np.ones(variances.ndim - 1, dtype=int))
    spread = np.sum(variances**2 / along, axis=0)
    some = spread > 0.0
    effective = np.sum(variances, axis=0) ** 2 / np.where(some, spread, 1.0)
    return np.minimum(np.where(some, effective, _MANY), _MANY)
