"""What the data determine of each fitted coefficient: linearised intervals, and flags."""

# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false
# pyright: reportUnknownVariableType=false

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.special

from pamsim.core.units import FloatArray
from pamsim.fitting.linear_part import Curve
from pamsim.inference.coefficient import Coefficient
from pamsim.inference.estimate import Estimate, Flag
from pamsim.inference.identifiability import covariance_along, determined, trade_offs

_student_quantile: Any = scipy.special.stdtrit

_DEAD = 1e-10  # effect over the whole allowed range, relative to the data
_SINGULAR = 1e-7  # smallest over largest singular value of the column-scaled Jacobian
_AT_BOUND = 1e-6  # of the allowed range


def curve_estimates(
    curve: Curve, measured: FloatArray, values: FloatArray, coefficients: Sequence[Coefficient]
) -> tuple[Estimate, ...]:
    """Give each coefficient its 95 % interval and its flags.

    The covariance is s^2 (J^T J)^-1 at the optimum, J by central differences, s^2 the residual
    variance with n - k degrees of freedom. Coefficients at a bound are taken as given there.

    Args:
        curve: predictions from all coefficients.
        measured: shape (n,).
        values: the optimum, shape (k,) [SI].
        coefficients: ranges and which are held.

    Returns:
        One per coefficient, in order.
    """
    flags: dict[int, list[Flag]] = {i: [] for i in range(len(coefficients))}
    partners: dict[int, set[str]] = {i: set() for i in range(len(coefficients))}
    free = [i for i, c in enumerate(coefficients) if c.held is None]
    jacobian = _jacobian(curve, values, coefficients)
    data = max(float(np.linalg.norm(measured)), 1e-300)
    inner: list[int] = []
    for i in free:
        width = coefficients[i].high - coefficients[i].low
        if float(np.linalg.norm(jacobian[:, i])) * width <= _DEAD * data:
            flags[i].append(Flag.DEAD)
        elif min(values[i] - coefficients[i].low, coefficients[i].high - values[i]) < (
            _AT_BOUND * width
        ):
            flags[i].append(Flag.AT_BOUND)
        else:
            inner.append(i)
    residual = curve(values) - measured
    half = np.full(len(coefficients), np.nan)
    freedom = measured.size - len(inner)
    if inner and freedom > 0:
        variance = float(residual @ residual) / freedom
        split = determined(jacobian[:, inner], _SINGULAR)
        covariance, flat = covariance_along(jacobian[:, inner], split.basis), split.members
        spread = np.sqrt(np.diag(covariance))
        quantile = float(_student_quantile(freedom, 0.975))
        for a, i in enumerate(inner):
            if flat[a]:
                flags[i].append(Flag.FLAT_DIRECTION)
                partners[i] |= {
                    coefficients[j].name for b, j in enumerate(inner) if flat[b] and j != i
                }
                continue
            half[i] = quantile * np.sqrt(variance) * spread[a]
            correlated = [coefficients[inner[b]].name for b in trade_offs(covariance, a, flat)]
            if correlated:
                flags[i].append(Flag.TRADE_OFF)
                partners[i] |= set(correlated)
            if half[i] > abs(values[i]):
                flags[i].append(Flag.NOT_PINNED)
    return tuple(
        Estimate(
            name=c.name,
            unit=c.unit,
            value=float(values[i]),
            interval95=None
            if not np.isfinite(half[i])
            else (float(values[i] - half[i]), float(values[i] + half[i])),
            bounds=(c.low, c.high),
            held=c.held is not None,
            flags=tuple(flags[i]),
            partners=tuple(sorted(partners[i])),
        )
        for i, c in enumerate(coefficients)
    )


def _jacobian(curve: Curve, values: FloatArray, coefficients: Sequence[Coefficient]) -> FloatArray:
    """Central differences, shape (n, k); zero columns for held coefficients."""
    columns: list[FloatArray] = []
    for i, c in enumerate(coefficients):
        step = np.zeros(values.size)
        # The cube root of the rounding error is the best step of a central difference.
        step[i] = 6e-6 * max(abs(float(values[i])), 1e-3 * (c.high - c.low))
        ahead, behind = values + step, values - step
        ahead[i], behind[i] = min(ahead[i], c.high), max(behind[i], c.low)
        if c.held is not None:
            columns.append(np.zeros_like(curve(values)))
            continue
        columns.append((curve(ahead) - curve(behind)) / (ahead[i] - behind[i]))
    return np.stack(columns, axis=1)
