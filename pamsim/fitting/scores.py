"""Scores of a fitted curve: errors, information criteria, and errors at held-out points."""

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

_APART = 2.0
"""Distance of levels over their width, from which readings lie about levels: in random numbers
hardly ever (one set of 13 in a hundred)."""


@dataclass(frozen=True, kw_only=True)
class Scores:
    """How well predictions match measurements."""

    points: int  # number of points n
    free: int  # number of fitted coefficients k
    mse: float  # mean square error [unit^2]
    rmse: float  # its root [unit]
    mae: float  # mean absolute error [unit]
    r2: float | None  # 1 - SSE / SST; None if the measurements are all equal
    # Akaike's criterion n ln(SSE/n) + 2 (k + 1), the one beyond k for the noise; None for a
    # perfect match. Only differences between models of the same points mean anything
    aic: float | None
    aicc: float | None  # with the correction for few points; None also if n <= k + 2


def scores(measured: ArrayLike, predicted: ArrayLike, free: int) -> Scores:
    """Score predictions (n,) of measurements (n,), both in one unit.

    ``free`` coefficients were fitted to these measurements, 0 for held-out ones.

    Raises:
        InputError: no points, differing lengths, or values that are not finite.
    """
    y, yhat = finite_samples(measured, "measured"), finite_samples(predicted, "predicted")
    if y.size == 0 or y.size != yhat.size:
        raise InputError(f"measured has {y.size} points, predicted {yhat.size}; give one for one")
    residual = yhat - y
    n, square = y.size, float(residual @ residual)
    spread = float(np.sum((y - np.mean(y)) ** 2))
    # Of a perfect match only rounding remains, whose logarithm means nothing.
    perfect = square <= 1e-28 * float(y @ y)
    aic = None if perfect else n * math.log(square / n) + 2.0 * (free + 1)
    few = n - free - 2
    correction = 2.0 * (free + 1) * (free + 2) / few if few > 0 else None
    return Scores(
        points=n,
        free=free,
        mse=square / n,
        rmse=math.sqrt(square / n),
        mae=float(np.mean(np.abs(residual))),
        r2=1.0 - square / spread if spread > 0.0 else None,
        aic=aic,
        aicc=None if aic is None or correction is None else aic + correction,
    )


@dataclass(frozen=True, kw_only=True)
class HeldOut:
    """Errors at points that were not fitted, one group of points at a time."""

    by: str  # what was held out, such as ``length``
    groups: FloatArray  # a number for each group, such as its mean contraction, shape (g,)
    # Error in each group; NaN where the rest does not determine the curve, (g,)
    group_rmse: FloatArray
    # Predicted minus measured at every point, each by a fit without it, shape (n,)
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

    ``groups`` (n,) has the same number for points of one group, ``by`` names what is held out.
    ``fit_and_predict`` is called with the rows to fit and those to predict; it must use the
    measurements of the first only, and raises InputError where they are too few.

    Raises:
        InputError: fewer than two groups: nothing is left to fit.
    """
    y, label = finite_samples(measured, "measured"), finite_samples(groups, by)
    kinds = np.unique(label)
    if kinds.size < 2:
        raise InputError(
            f"all points share one {by}, and holding it out leaves nothing to fit; give another"
            " `hold_out`, or none"
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

    Equal values are a group. Of more than ``most`` values, readings that scatter about a level are
    one; without levels, values of which most occur once make ``most`` neighbouring bins.
    """
    x = finite_samples(values, "values")
    kinds, index = np.unique(x, return_inverse=True)
    level = _levels(kinds) if kinds.size > most else np.arange(kinds.size)
    if level[-1] + 1 < kinds.size:
        index = level[index]
    elif kinds.size > max(most, x.size // 2):
        index = np.empty(x.size, dtype=np.intp)
        index[np.argsort(x, kind="stable")] = np.arange(x.size) * most // x.size
    count = np.bincount(index)
    return (np.bincount(index, weights=x) / count)[index]


def _levels(kinds: FloatArray) -> Rows:
    """The level (n,) of each of rising values, from 0; each its own if they lie about none.

    A regulator holds a set pressure to tenths of a kPa: the widest level is far narrower than the
    least distance between two. Levels are cut where that ratio is largest.
    """
    gaps = np.diff(kinds)
    falling = np.sort(gaps)[::-1]
    level, best = np.arange(kinds.size), _APART
    for cuts in range(1, kinds.size // 2):  # two values a level and more
        # No level is narrower than the widest gap inside one.
        if falling[cuts - 1] <= best * falling[cuts]:
            continue
        cut = gaps > falling[cuts]
        first = np.append(0, np.flatnonzero(cut) + 1)
        last = np.append(first[1:], kinds.size) - 1
        apart = float(falling[cuts - 1] / np.max(kinds[last] - kinds[first]))
        if apart > best:
            level, best = np.append(0, np.cumsum(cut)), apart
    return level
