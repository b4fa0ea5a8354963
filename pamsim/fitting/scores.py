"""Scores of a fitted curve: errors, explained variance, information criteria."""

# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.special
from numpy.typing import ArrayLike

from pamsim.core.errors import InputError
from pamsim.inference.record_checks import finite_samples

_f_tail: Any = scipy.special.fdtrc


@dataclass(frozen=True, kw_only=True)
class Scores:
    """How well predictions match measurements.

    Attributes:
        points: number of points n.
        free: number of fitted coefficients k.
        mse: mean square error [unit^2].
        rmse: its root [unit].
        mae: mean absolute error [unit].
        r2: 1 - SSE / SST; None if the measurements are all equal.
        aic: Akaike's criterion n ln(SSE/n) + 2 (k + 1), the one beyond k for the noise; None for a
            perfect match. Only differences between models of the same points mean anything.
        aicc: with the correction for few points; None also if n <= k + 2.
    """

    points: int
    free: int
    mse: float
    rmse: float
    mae: float
    r2: float | None
    aic: float | None
    aicc: float | None


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


def shared_by_group(residual: ArrayLike, groups: ArrayLike) -> float:
    """P-value of residuals (n,) that agree so well within groups, if they were independent.

    Points of one length share its reading error. If that is significant (a small p-value), the fit
    has less information than its number of points suggests, and intervals that take them as
    independent are too narrow. ``groups`` (n,) has the same number for points of one group.

    The one-way analysis of variance (Fisher's F); 1 where it does not apply.
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
    return float(_f_tail(kinds.size - 1, inside, between / within))
