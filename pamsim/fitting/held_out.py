"""Errors at held-out points: groups of equal pressure or length, held out in turn."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pamsim.core.encoding import json_property
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.inference.record_checks import finite_samples

Rows = NDArray[np.intp]


@dataclass(frozen=True, kw_only=True)
class HeldOut:
    """Errors at points that were not fitted, one group of points at a time.

    Attributes:
        by: what was held out, such as ``length``.
        groups: a number for each group, such as its mean contraction, shape (g,).
        group_rmse: error in each group; NaN where the rest does not determine the curve, (g,).
        residual: predicted minus measured at every point, each by a fit without it, shape (n,).
    """

    by: str
    groups: FloatArray
    group_rmse: FloatArray
    residual: FloatArray

    @json_property
    def rmse(self) -> float:
        """Root mean square over all points; NaN if a group could not be predicted."""
        # A diverging prediction may overflow: its error is then infinite.
        with np.errstate(over="ignore"):
            return math.sqrt(float(np.mean(self.residual**2)))

    @json_property
    def worst(self) -> float:
        """The largest group's error; NaN if a group could not be predicted."""
        return float(np.max(self.group_rmse))


def leave_one_group_out(
    measured: ArrayLike,
    groups: ArrayLike,
    fit_and_predict: Callable[[Rows, Rows], FloatArray],
    *,
    by: str,
) -> HeldOut:
    """Errors of each group of points, predicted from a fit to all others.

    Args:
        measured: shape (n,).
        groups: the same number for points of one group, shape (n,).
        fit_and_predict: called with the rows to fit and the rows to predict; it must use the
            measurements of the first only. Raises InputError where the rows are too few.
        by: name of what is held out.

    Raises:
        InputError: fewer than two groups: nothing is left to fit.
    """
    y, label = finite_samples(measured, "measured"), finite_samples(groups, by)
    kinds = np.unique(label)
    if kinds.size < 2:
        raise InputError(
            f"all points share one {by}: `hold_out` leaves nothing to fit; hold out none"
        )
    residual = np.full(y.size, np.nan)
    errors = np.full(kinds.size, np.nan)
    for i, kind in enumerate(kinds):
        test, train = np.flatnonzero(label == kind), np.flatnonzero(label != kind)
        try:
            residual[test] = fit_and_predict(train, test) - y[test]
        except InputError:
            continue
        # A prediction that is not finite counts as an infinite error, not as missing.
        with np.errstate(over="ignore"):
            errors[i] = float(np.sqrt(np.mean(residual[test] ** 2)))
    return HeldOut(by=by, groups=kinds, group_rmse=errors, residual=residual)


def grouped(values: ArrayLike, most: int = 12) -> FloatArray:
    """Mean (n,) of the group of each point's value (n,), such as its contraction.

    Equal values are a group; where values scatter, one of ``most`` neighbouring bins.
    """
    x = finite_samples(values, "values")
    kinds, index = np.unique(x, return_inverse=True)
    if kinds.size > most and kinds.size > x.size // 2:
        index = np.empty(x.size, dtype=np.intp)
        index[np.argsort(x, kind="stable")] = np.arange(x.size) * most // x.size
    count = np.bincount(index)
    return (np.bincount(index, weights=x) / count)[index]
