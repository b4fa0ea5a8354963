"""How often chance alone would make one of many effects fit rows as well as the best one does.

Freedman and Lane (1983): under the model without the effect its residuals may stand in any order.
Every order is fitted with all effects' slopes, and only the best of them counts (Westfall and Young
1993), so that effects that look alike are not paid for twice.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as fisher

from pamsim.diagnosis.method.row_fit import RowFit

FloatArray = NDArray[np.float64]

_ORDERS = 2_999
_RANK = 1e-8  # of the largest singular value: what slopes below it span is none


def luck(parent: RowFit, others: Sequence[RowFit], *, seed: int = 0) -> list[float]:
    """Chance that the best effect gains as much on rows in any other order.

    Args:
        parent: the model without them.
        others: the model with each effect that was tried.
        seed: of the orders.

    Returns:
        For each effect a p-value that counts all of them.
    """
    count = parent.residual.size
    # In the order of size, so that the order of a table's rows changes nothing.
    order = np.argsort(parent.residual, kind="stable")
    spanned = _span(parent.jacobian[order])
    leverage = np.minimum(np.sum(spanned**2, axis=1), 1.0 - 1e-9)
    rest = parent.residual[order] / np.sqrt(1.0 - leverage)
    rng = np.random.default_rng(seed)
    mixed = rng.permuted(np.tile(rest - rest.mean(), (_ORDERS, 1)), axis=1).T
    before = np.sum(mixed**2, axis=0) - np.sum((spanned.T @ mixed) ** 2, axis=0)
    own: list[float] = []
    most: dict[tuple[int, int], FloatArray] = {}  # largest gains, by degrees of freedom
    total = np.array([float(parent.residual @ parent.residual)])
    for other in others:
        wider = _span(other.jacobian[order])
        added = max(other.jacobian.shape[1] - parent.jacobian.shape[1], 1)
        left = count - spanned.shape[1] - added
        if left < 1:
            own.append(1.0)
            continue
        after = np.sum(mixed**2, axis=0) - np.sum((wider.T @ mixed) ** 2, axis=0)
        ratio = _ratio(before, after, added, left)
        most[added, left] = np.maximum(most.get((added, left), 0.0), ratio)
        reached = np.array([float(other.residual @ other.residual)])
        own.append(float(fisher.sf(_ratio(total, reached, added, left), added, left)[0]))
    # The tail of an F distribution is a common scale for effects of one number and of two.
    best = np.ones(_ORDERS)
    for (added, left), ratio in most.items():
        best = np.minimum(best, fisher.sf(ratio, added, left))
    return [(1 + int(np.sum(best <= p * (1.0 + 1e-9)))) / (1 + _ORDERS) for p in own]


def _span(slopes: FloatArray) -> FloatArray:
    """Orthonormal columns that span the slopes, (n, r)."""
    if slopes.shape[1] == 0:
        return np.empty((slopes.shape[0], 0))
    scaled = slopes / np.maximum(np.linalg.norm(slopes, axis=0), 1e-300)
    left, size, _ = np.linalg.svd(scaled, full_matrices=False)
    return left[:, size > _RANK * max(float(size[0]), 1e-300)]


def _ratio(before: FloatArray, after: FloatArray, added: int, left: int) -> FloatArray:
    """F ratio of a gain."""
    return np.maximum(before - after, 0.0) / added / np.maximum(after / left, 1e-300)
