"""Whether units whose inputs are near each other miss something together.

Without repeats it is not known what a perfect model would leave. But what a model misses changes
little between near inputs, and noise is independent: the mean product of a unit's residual with
that of its nearest neighbours estimates the mean square of what both miss, as the product of two
repeats does (`pamsim.comparison.repeated_misfit`). Where noise alone is left, every residual may as
well have the other sign, whatever its variance; under each pattern of signs the model is fitted
again, to first order. What changes from one input to the next is not seen.

Sources: R. Christensen, The Annals of Statistics 17 (1989), 673 (lack of fit by near replicates);
A. Winkler et al., NeuroImage 92 (2014), 381 (flips of residuals beside a fitted model).
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.distance import cdist

from pamsim.core.units import FloatArray
from pamsim.inference.model_comparison import sign_patterns, unit_order, upper_p_value
from pamsim.inference.projected_effect import orthonormal

_AS_NEAR = 1e-9  # of the largest distance: neighbours that differ by rounding alone
_DETERMINED = 1e-9  # share of a row's variance that a fit leaves, below which it passes through it


def nearest_units(inputs: FloatArray) -> FloatArray:
    """Weights of each unit's nearest neighbours, (n, n), with a sum of 1 in every row.

    Args:
        inputs: (n, k) of n units, two or more; each column counts by its span.
    """
    span = np.ptp(inputs, axis=0)
    scaled = inputs[:, span > 0.0] / span[span > 0.0]
    apart = cdist(scaled, scaled) if scaled.size else np.zeros((len(inputs), len(inputs)))
    np.fill_diagonal(apart, np.inf)
    limit = apart.min(axis=1, keepdims=True) + _AS_NEAR * np.sqrt(scaled.shape[1])
    near = np.where(apart <= limit, 1.0, 0.0)
    return near / near.sum(axis=1, keepdims=True)


def missed_together(
    rows: FloatArray, jacobian: FloatArray, near: FloatArray, *, seed: int = 0
) -> tuple[float, float]:
    """What near units miss together.

    Args:
        rows: (n,) whitened residual of a fitted model, one row of each unit.
        jacobian: (n, p) of it.
        near: see `nearest_units`.
        seed: random seed of the sign patterns, where they are drawn.

    Returns:
        Mean square of it [noise variance], which may be below 0, and the p-value of nothing.
    """
    order = unit_order(rows[:, np.newaxis])
    own, weights = rows[order], near[np.ix_(order, order)]
    basis = orthonormal(jacobian)[order]
    # What a fit takes of a row's variance; a row that it passes through shows nothing.
    free = 1.0 - np.sum(basis**2, axis=1)
    shown = free > _DETERMINED
    noise = np.where(shown, own, 0.0) / np.sqrt(np.where(shown, free, 1.0))
    drawn: list[FloatArray] = []
    for signs in sign_patterns(rows.size, np.random.default_rng(seed)):
        flipped = signs * noise
        flipped -= (flipped @ basis) @ basis.T
        drawn.append(np.mean(flipped * (flipped @ weights.T), axis=1))
    products, observed = np.concatenate(drawn), float(np.mean(own * (weights @ own)))
    p_value = upper_p_value(products, observed, scale=float(np.mean(noise**2)))
    return observed - float(products.mean()), p_value
