"""Least squares of any curve with bounded coefficients: several starts, intervals, flags."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from pamsim.core.encoding import NOT_IN_JSON
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.fitting.curve_estimates import curve_estimates
from pamsim.fitting.linear_part import Curve, best_linear, linear_coefficients
from pamsim.fitting.scores import Scores, scores
from pamsim.inference.bounded_least_squares import bounded_least_squares, one_by_one
from pamsim.inference.coefficient import Coefficient
from pamsim.inference.estimate import Estimate, without_intervals
from pamsim.inference.record_checks import finite_samples
from pamsim.inference.starts import latin_hypercube

_REFINED = 3  # starts that are followed to their end, of those tried


@dataclass(frozen=True)
class Optimum:
    """Where a search ended.

    Attributes:
        values: all coefficients, shape (k,) [SI].
        predicted: the curve there, shape (n,).
        converged: False if the solver ran out of evaluations.
        evaluations: of the curve, over all starts.
    """

    values: FloatArray
    predicted: FloatArray
    converged: bool
    evaluations: int


@dataclass(frozen=True)
class CurveFit:
    """A fitted curve.

    The intervals are linearised at the optimum, with Student's t. They take the residuals as
    independent; residuals of a law with the wrong shape, or of points that share one misread
    length, are not, and then the intervals are too narrow.

    Attributes:
        coefficients: in the order given, with intervals and flags.
        predicted: shape (n,).
        residual: predicted minus measured, shape (n,).
        scores: in-sample.
        converged: False if the solver ran out of evaluations.
        evaluations: of the curve.
    """

    coefficients: tuple[Estimate, ...]
    predicted: FloatArray = field(metadata=NOT_IN_JSON)
    residual: FloatArray = field(metadata=NOT_IN_JSON)
    scores: Scores
    converged: bool
    evaluations: int

    def __post_init__(self) -> None:
        """State no interval where the search did not converge."""
        if not self.converged:
            object.__setattr__(self, "coefficients", without_intervals(self.coefficients))

    @property
    def values(self) -> FloatArray:
        """All coefficients, shape (k,) [SI]."""
        return np.array([c.value for c in self.coefficients])


def search_curve(
    curve: Curve,
    measured: ArrayLike,
    coefficients: Sequence[Coefficient],
    *,
    starts: int | None = None,
    seed: int = 0,
) -> Optimum:
    """Find the least-squares optimum within the coefficients' ranges.

    Coefficients in which the curve is linear are solved for, the others are searched from a Latin
    hypercube of starts and from their neutral values; the most promising are followed to the end.
    The same seed gives the same result.

    Args:
        curve: all coefficients, shape (k,) [SI], to the predictions, shape (n,).
        measured: shape (n,).
        coefficients: ranges, neutral and held values.
        starts: how many to try; None for eight per coefficient that is searched.
        seed: of the starts.

    Returns:
        The best optimum.

    Raises:
        InputError: fewer points than free coefficients, a measurement that is not finite, a range
            that is empty, or a curve that has no value at the points for any coefficients tried.
    """
    y = finite_samples(measured, "measured")
    free = [i for i, c in enumerate(coefficients) if c.held is None]
    for c in coefficients:
        if not c.low < c.high:
            raise InputError(f"{c.name}: range [{c.low:g}, {c.high:g}] is empty")
    if y.size <= len(free):
        raise InputError(
            f"{y.size} points do not determine {len(free)} coefficients; measure more or hold some"
        )
    count = 0

    def counted(values: FloatArray) -> FloatArray:
        nonlocal count
        count += 1
        # A search evaluates extreme values too: overflow there is a result, not a fault.
        with np.errstate(all="ignore"):
            return curve(values)

    rng = np.random.default_rng(seed)
    origin = np.array([_first(c) for c in coefficients])
    linear = linear_coefficients(counted, coefficients, origin)
    searched = [i for i in free if i not in linear]
    low = np.array([coefficients[i].low for i in searched])
    high = np.array([coefficients[i].high for i in searched])
    # The residual where a curve has no value: far larger than any sensible one.
    sizes = np.abs(np.concatenate([y, counted(origin)]))
    penalty = 1e3 * max(float(np.max(sizes[np.isfinite(sizes)])), 1e-300)

    def filled(u: FloatArray) -> tuple[FloatArray, FloatArray]:
        place = origin.copy()
        place[searched] = u
        return best_linear(counted, y, place, linear, coefficients)

    def residual(u: FloatArray) -> FloatArray:
        miss = filled(u)[1] - y
        return np.clip(np.nan_to_num(miss, nan=penalty), -penalty, penalty)

    end, converged = origin[searched], True
    if searched:
        many = 8 * len(searched) if starts is None else starts
        spread = latin_hypercube(rng, many, len(searched)) * (high - low)
        search = bounded_least_squares(
            one_by_one(residual),
            [end, *(low + spread)],
            lower=low,
            upper=high,
            x_scale=high - low,
            tolerance=1e-11,
            gradient_tolerance=1e-13,
            max_steps=200,
            follow=_REFINED,
        )
        end, converged = search.x, search.converged
    values, _ = filled(end)
    predicted = counted(values)
    if not np.all(np.isfinite(predicted)):
        raise InputError(
            f"the curve has no value at {int(np.sum(~np.isfinite(predicted)))} of {y.size} points"
            " for any coefficients tried: it does not hold there"
        )
    return Optimum(values, predicted, converged, count)


def fit_curve(
    curve: Curve,
    measured: ArrayLike,
    coefficients: Sequence[Coefficient],
    *,
    starts: int | None = None,
    seed: int = 0,
) -> CurveFit:
    """Fit a curve and state what the data determine of each coefficient.

    Args:
        curve: all coefficients, shape (k,) [SI], to the predictions, shape (n,).
        measured: shape (n,).
        coefficients: ranges, neutral and held values.
        starts: how many to try; None for eight per coefficient that is searched.
        seed: of the starts.

    Returns:
        The fit.

    Raises:
        InputError: as `search_curve`.
    """
    y = finite_samples(measured, "measured")
    optimum = search_curve(curve, y, coefficients, starts=starts, seed=seed)
    free = sum(c.held is None for c in coefficients)
    return CurveFit(
        coefficients=curve_estimates(curve, y, optimum.values, coefficients),
        predicted=optimum.predicted,
        residual=optimum.predicted - y,
        scores=scores(y, optimum.predicted, free),
        converged=optimum.converged,
        evaluations=optimum.evaluations,
    )


def _first(c: Coefficient) -> float:
    if c.held is not None:
        return c.held
    return 0.5 * (c.low + c.high) if c.default is None else c.default
