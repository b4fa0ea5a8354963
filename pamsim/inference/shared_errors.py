"""Errors that the points of a group share, such as an offset of one pressure sweep.

Such points hold less information than as many independent ones: standard errors that take them as
independent are too small. Here errors are independent between groups, and arbitrary within.

Source: Bell and McCaffrey, Survey Methodology 28 (2002): residuals corrected for what the fit takes
up of them, and the degrees of freedom by Satterthwaite's approximation. Without both, intervals are
too narrow where groups are few.
"""

from __future__ import annotations

import numpy as np
import scipy.special
from numpy.typing import ArrayLike

from pamsim.core.units import FloatArray
from pamsim.inference.record_checks import finite_samples

_TAKEN = 1e-10  # share of a direction of a group's errors that the fit leaves, below which none


def shared_by_group(residual: ArrayLike, groups: ArrayLike) -> float:
    """P-value of residuals (n,) that agree so well within groups, if they were independent.

    ``groups`` (n,) has the same number for points of one group. The one-way analysis of variance
    (Fisher's F); 1 where it does not apply.
    """
    r, label = finite_samples(residual, "residual"), finite_samples(groups, "groups")
    kinds, index = np.unique(label, return_inverse=True)
    inside = r.size - kinds.size
    if kinds.size < 2 or inside < 1:
        return 1.0
    count = np.bincount(index)
    mean = np.bincount(index, weights=r) / count
    between = float(np.sum(count * (mean - np.mean(r)) ** 2)) / (kinds.size - 1)
    within = float(np.sum((r - mean[index]) ** 2)) / inside
    if within == 0.0:
        return 1.0
    return float(scipy.special.fdtrc(kinds.size - 1, inside, between / within))


def errors_of_groups(
    jacobian: FloatArray, residual: FloatArray, groups: FloatArray, inverse: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Standard errors (k,) where errors are independent between groups only, with their freedom.

    They are those of least squares with a Jacobian (n, k), and an ``inverse`` (k, k) of J^T J or
    its pseudoinverse. ``groups`` (n,) has the same number for points of one group. The degrees of
    freedom (k,) are those of Student's t.
    """
    sizes, vectors = np.linalg.eigh(inverse)
    half = vectors * np.sqrt(np.maximum(sizes, 0.0))
    scores: list[FloatArray] = []
    squares: list[FloatArray] = []
    crossed: list[FloatArray] = []
    for label in np.unique(groups):
        own = groups == label
        columns = jacobian[own]
        basis, taken, _ = np.linalg.svd(columns @ half, full_matrices=False)
        left = 1.0 - taken**2
        more = np.where(left > _TAKEN, 1.0 / np.sqrt(np.maximum(left, _TAKEN)), 0.0) - 1.0
        weights = columns @ inverse
        weights += basis @ (more[:, np.newaxis] * (basis.T @ weights))
        scores.append(residual[own] @ weights)
        squares.append(np.sum(weights**2, axis=0))
        crossed.append(columns.T @ weights)
    freedom = np.empty(inverse.shape[0])
    for i in range(freedom.size):
        to = np.stack([one[:, i] for one in crossed])
        spread = np.diag([own[i] for own in squares]) - to @ inverse @ to.T
        freedom[i] = np.trace(spread) ** 2 / np.sum(spread**2)
    return np.sqrt(np.sum(np.square(scores), axis=0)), freedom
