"""Errors at points a fit has not seen: groups of equal pressure or length, held out in turn."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pamsim.core.errors import InputError
from pamsim.inference.record_checks import finite_samples

FloatArray = NDArray[np.float64]
Rows = NDArray[np.intp]


@dataclass(frozen=True)
class HeldOut:
    """Errors at points that the fit did not see, one group at a time.

    Attributes:
        by: what was held out, such as ``length``.
        groups: a number for each group, such as its mean contraction, shape (g,).
        rmse: error in each group; NaN where the rest does not determine the curve, shape (g,).
        residual: predicted minus measured at every point, each by a fit without it, shape (n,).
    """

    by: str
    groups: FloatArray
    rmse: FloatArray
    residual: FloatArray

    @property
    def pooled(self) -> float:
        """Root mean square over all points; NaN if a group could not be predicted."""
        # A diverging prediction may overflow: its error is then infinite, which is the truth.
        with np.errstate(over="ignore"):
            return math.sqrt(float(np.mean(self.residual**2)))

    @property
    def worst(self) -> float:
        """The largest group's error; NaN if a group could not be predicted."""
        return float(np.max(self.rmse))

    def as_dict(self) -> dict[str, Any]:
        """JSON-safe form; what could not be predicted is None."""
        return {
            "by": self.by,
            "rmse": _or_none(self.pooled),
            "worst": _or_none(self.worst),
            "groups": self.groups.tolist(),
            "group_rmse": [_or_none(float(value)) for value in self.rmse],
        }


def leave_one_group_out(
    measured: ArrayLike,
    groups: ArrayLike,
    fit_and_predict: Callable[[Rows, Rows], FloatArray],
    *,
    by: str,
) -> HeldOut:
    """Predict each group of points from a fit to all others.

    Args:
        measured: shape (n,).
        groups: the same number for points of one group, shape (n,).
        fit_and_predict: is given the rows to fit and the rows to predict; it must look at the
            measurements of the first only. Raises InputError where the rows are too few.
        by: name of what is held out.

    Returns:
        The errors.

    Raises:
        InputError: fewer than two groups: nothing is left to fit.
    """
    y, label = finite_samples(measured, "measured"), finite_samples(groups, by)
    kinds = np.unique(label)
    if kinds.size < 2:
        raise InputError(
            f"all points share one {by}: holding it out leaves nothing to fit; hold out none"
        )
    residual = np.full(y.size, np.nan)
    errors = np.full(kinds.size, np.nan)
    for i, kind in enumerate(kinds):
        test, train = np.flatnonzero(label == kind), np.flatnonzero(label != kind)
        try:
            residual[test] = fit_and_predict(train, test) - y[test]
        except InputError:
            continue
        # A prediction that leaves the finite numbers is as bad as they go, not missing.
        with np.errstate(over="ignore"):
            errors[i] = float(np.sqrt(np.mean(residual[test] ** 2)))
    return HeldOut(by, kinds, errors, residual)


def grouped(values: ArrayLike, most: int = 12) -> FloatArray:
    """Label points by value, or by one of ``most`` neighbouring bins where values scatter.

    Args:
        values: such as the contraction of each point, shape (n,).
        most: most groups.

    Returns:
        The mean value of each point's group, shape (n,).
    """
    x = finite_samples(values, "values")
    kinds, index = np.unique(x, return_inverse=True)
    if kinds.size > most and kinds.size > x.size // 2:
        index = np.empty(x.size, dtype=np.intp)
        index[np.argsort(x, kind="stable")] = np.arange(x.size) * most // x.size
    count = np.bincount(index)
    return (np.bincount(index, weights=x) / count)[index]


def _or_none(value: float) -> float | None:
    return value if math.isfinite(value) else None
