"""Exchange of residuals: whether the best of many extensions of a model is so by chance.

A p-value counts the observed order among the drawn ones (Phipson and Smyth 2010), so that it is
never 0.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import f as f_distribution

from pamsim.core.units import FloatArray
from pamsim.inference.projected_effect import orthonormal

ORDERS = 2_999
"""Orders drawn: a p-value of 0.05 is then known to a twelfth of itself, the smallest is 0.00033."""
_RANK = 1e-8
"""Share of the largest singular value below which a direction of a Jacobian counts as none."""


def best_of_many_p_values(
    residual: FloatArray,
    jacobian: FloatArray,
    extended: Sequence[tuple[FloatArray, FloatArray]],
    *,
    seed: int = 0,
) -> list[float]:
    """P-value of each extension of a model, corrected for choosing the best of all of them.

    Under the model without extensions its residuals may stand in any order (Freedman and Lane
    1983). Every order is fitted with the Jacobians of all extensions, and only the best of them
    counts (Westfall and Young 1993), so that extensions with similar signatures are not counted
    twice.

    Args:
        residual: (n,) of the model.
        jacobian: (n, p) of the model.
        extended: residual (n,) and Jacobian (n, p + q) of each extended model after its fit.
        seed: random seed of the orders.
    """
    count = residual.size
    # In the order of size, so that the order of a table's rows changes nothing.
    order = np.argsort(residual, kind="stable")
    spanned = orthonormal(jacobian[order], _RANK)
    leverage = np.minimum(np.sum(spanned**2, axis=1), 1.0 - 1e-9)
    rest = residual[order] / np.sqrt(1.0 - leverage)
    rng = np.random.default_rng(seed)
    mixed = rng.permuted(np.tile(rest - rest.mean(), (ORDERS, 1)), axis=1).T
    before = np.sum(mixed**2, axis=0) - np.sum((spanned.T @ mixed) ** 2, axis=0)
    tails: list[float] = []
    largest: dict[tuple[int, int], FloatArray] = {}  # F ratios, by degrees of freedom
    total = np.array([float(residual @ residual)])
    for extended_residual, extended_jacobian in extended:
        wider = orthonormal(extended_jacobian[order], _RANK)
        added = max(extended_jacobian.shape[1] - jacobian.shape[1], 1)
        left = count - spanned.shape[1] - added
        if left < 1:
            tails.append(1.0)
            continue
        after = np.sum(mixed**2, axis=0) - np.sum((wider.T @ mixed) ** 2, axis=0)
        ratio = _f_ratio(before, after, added, left)
        largest[added, left] = np.maximum(largest.get((added, left), 0.0), ratio)
        reached = np.array([float(extended_residual @ extended_residual)])
        own = f_distribution.sf(_f_ratio(total, reached, added, left), added, left)
        tails.append(float(own[0]))
    # The tail of an F distribution is a common scale for extensions by one and by two parameters.
    best = np.ones(ORDERS)
    for (added, left), ratio in largest.items():
        best = np.minimum(best, f_distribution.sf(ratio, added, left))
    return [(1 + int(np.sum(best <= p * (1.0 + 1e-9)))) / (1 + ORDERS) for p in tails]


def _f_ratio(before: FloatArray, after: FloatArray, added: int, left: int) -> FloatArray:
    """F ratio of a fall of the sum of squares."""
    return np.maximum(before - after, 0.0) / added / np.maximum(after / left, 1e-300)
