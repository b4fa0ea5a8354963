"""Least squares of any curve with bounded coefficients: several starts, intervals, flags."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import scipy.special
from numpy.typing import ArrayLike

from pamsim.core.encoding import NOT_IN_JSON
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.fitting.coefficients import Coefficient, Curve, best_linear, linear_coefficients
from pamsim.fitting.scores import HeldOut, Rows, Scores, leave_one_group_out, scores
from pamsim.inference.bounded_least_squares import bounded_least_squares, latin_hypercube
from pamsim.inference.estimate import Estimate, Flag, without_intervals
from pamsim.inference.identifiability import covariance_along, determined, trade_offs
from pamsim.inference.record_checks import finite_samples
from pamsim.inference.shared_errors import errors_of_groups, shared_by_group

_STARTS = 8  # tried per coefficient that is searched
_REFINED = 3  # starts that are followed to their end, of those tried
_DEAD = 1e-10  # effect over the whole allowed range, relative to the data
_SINGULAR = 1e-7  # smallest over largest singular value of the column-scaled Jacobian
_AT_BOUND = 1e-6  # of the allowed range
_SHARED = 0.2
"""P-value of independent errors below which points of a group are taken to share one. Errors that
show so faintly make intervals too narrow all the same (scripts/fit_coverage.py)."""


class Optimum(NamedTuple):
    """Where a search ended: all coefficients (k,) [SI] and the predictions there, (n,).

    ``converged`` is False if the solver ran out of evaluations; ``evaluations`` of the curve are
    those of all starts.
    """

    values: FloatArray
    predicted: FloatArray
    converged: bool
    evaluations: int


@dataclass(frozen=True)
class CurveFit:
    """A fitted curve.

    The intervals are linearised at the optimum, with Student's t. They allow for errors that points
    of a group share, where residuals show some.
    """

    coefficients: tuple[Estimate, ...]  # in the order given, with intervals and flags
    predicted: FloatArray = field(metadata=NOT_IN_JSON)  # (n,)
    residual: FloatArray = field(metadata=NOT_IN_JSON)  # predicted minus measured, (n,)
    scores: Scores  # in-sample
    converged: bool  # False if the solver ran out of evaluations
    evaluations: int  # of the curve
    # Kind of group whose points share an error -> p-value of independent errors
    shared: Mapping[str, float] = field(default_factory=dict[str, float])

    def __post_init__(self) -> None:
        """State no interval where the search did not converge."""
        if not self.converged:
            object.__setattr__(self, "coefficients", without_intervals(self.coefficients))

    @property
    def values(self) -> FloatArray:
        """All coefficients, shape (k,) [SI]."""
        return np.array([c.value for c in self.coefficients])


def search_curve(curve: Curve, measured: ArrayLike, coefficients: Sequence[Coefficient]) -> Optimum:
    """Find the least-squares optimum within the coefficients' ranges, always the same one.

    Coefficients in which the curve is linear are solved for, the others are searched from a Latin
    hypercube of starts and from their neutral values; the most promising are followed to the end.

    Raises:
        InputError: fewer points (n,) than free coefficients, a measurement that is not finite, a
            range that is empty, or a curve that has no value at the points for any coefficients
            tried.
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

    rng = np.random.default_rng(0)
    neutral = [0.5 * (c.low + c.high) if c.default is None else c.default for c in coefficients]
    origin = np.array(
        [n if c.held is None else c.held for n, c in zip(neutral, coefficients, strict=True)]
    )
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
        spread = latin_hypercube(rng, _STARTS * len(searched), len(searched)) * (high - low)
        search = bounded_least_squares(
            residual,
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
    groups: Mapping[str, FloatArray] | None = None,
) -> CurveFit:
    """Fit a curve and state what the data determine of each coefficient.

    Arguments as of `search_curve`, and ``groups``: kind of group whose points may share an error ->
    (n,), the same number for points of one group.
    """
    y = finite_samples(measured, "measured")
    optimum = search_curve(curve, y, coefficients)
    free = sum(c.held is None for c in coefficients)
    residual = optimum.predicted - y
    tested = {kind: shared_by_group(residual, own) for kind, own in (groups or {}).items()}
    shared = {kind: p_value for kind, p_value in tested.items() if p_value < _SHARED}
    together = [own for kind, own in (groups or {}).items() if kind in shared]
    return CurveFit(
        coefficients=_estimates(curve, y, optimum.values, coefficients, together),
        predicted=optimum.predicted,
        residual=residual,
        scores=scores(y, optimum.predicted, free),
        converged=optimum.converged,
        evaluations=optimum.evaluations,
        shared=shared,
    )


def held_out_in_turn(
    curve_of: Callable[[Rows], Curve],
    measured: FloatArray,
    coefficients: Sequence[Coefficient],
    groups: FloatArray,
    *,
    by: str,
) -> HeldOut:
    """Errors of each group of points, predicted by a curve that is fitted to all others.

    Arguments as of `leave_one_group_out` and `search_curve`; ``curve_of`` gives the curve at some
    rows of the points.
    """

    def fit_and_predict(train: Rows, test: Rows) -> FloatArray:
        found = search_curve(curve_of(train), measured[train], coefficients)
        return curve_of(test)(found.values)

    return leave_one_group_out(measured, groups, fit_and_predict, by=by)


def _estimates(
    curve: Curve,
    measured: FloatArray,
    values: FloatArray,
    coefficients: Sequence[Coefficient],
    groups: Sequence[FloatArray],
) -> tuple[Estimate, ...]:
    """Each coefficient at the optimum (k,) [SI] with its 95 % interval and its flags.

    The covariance is s^2 (J^T J)^-1 at the optimum, J by central differences, s^2 the residual
    variance with n - k degrees of freedom; where points of some groups (n,) share an error, that
    of independent groups, the largest of several. Coefficients at a bound are taken as given there.
    """
    jacobian = difference_columns(curve, values, coefficients)
    low, high = np.array([(c.low, c.high) for c in coefficients]).T
    data = max(float(np.linalg.norm(measured)), 1e-300)
    free = np.array([c.held is None for c in coefficients])
    dead = free & (np.linalg.norm(jacobian, axis=0) * (high - low) <= _DEAD * data)
    near = np.minimum(values - low, high - values) < _AT_BOUND * (high - low)
    at_bound = free & ~dead & near
    inner = np.flatnonzero(free & ~dead & ~near)
    half, flat = np.full(free.size, np.nan), np.zeros(free.size, dtype=bool)
    correlated: dict[int, list[int]] = {}
    if inner.size:
        own, residual = jacobian[:, inner], curve(values) - measured
        split = determined(own, _SINGULAR)
        covariance = covariance_along(own, split.basis)
        freedom = float(measured.size - inner.size)
        variance = float(residual @ residual) / freedom
        errors = [(np.sqrt(variance * np.diag(covariance)), np.full(inner.size, freedom))]
        if groups:
            errors = [errors_of_groups(own, residual, one, covariance) for one in groups]
        widths = np.max([scipy.special.stdtrit(nu, 0.975) * error for error, nu in errors], axis=0)
        flat[inner] = split.members
        half[inner] = np.where(split.members, np.nan, widths)
        for a in np.flatnonzero(~split.members).tolist():
            correlated[int(inner[a])] = inner[trade_offs(covariance, a, split.members)].tolist()
    estimates: list[Estimate] = []
    for i, c in enumerate(coefficients):
        value, known = float(values[i]), bool(np.isfinite(half[i]))
        together = np.flatnonzero(flat).tolist() if flat[i] else correlated.get(i, [])
        flags = {
            Flag.DEAD: dead[i],
            Flag.AT_BOUND: at_bound[i],
            Flag.FLAT_DIRECTION: flat[i],
            Flag.TRADE_OFF: together and not flat[i],
            Flag.NOT_PINNED: known and half[i] > abs(value),
        }
        estimates.append(
            Estimate(
                name=c.name,
                unit=c.unit,
                value=value,
                interval95=(value - float(half[i]), value + float(half[i])) if known else None,
                bounds=(c.low, c.high),
                held=c.held is not None,
                flags=tuple(flag for flag, on in flags.items() if on),
                partners=tuple(sorted({coefficients[j].name for j in together} - {c.name})),
            )
        )
    return tuple(estimates)


def difference_columns(
    curve: Curve, values: FloatArray, coefficients: Sequence[Coefficient]
) -> FloatArray:
    """Change of a curve with its coefficients at some values (k,), shape (n, k).

    Central differences, within the ranges; zero columns for held coefficients.
    """
    columns: list[FloatArray] = []
    for i, c in enumerate(coefficients):
        if c.held is not None:
            columns.append(np.zeros_like(curve(values)))
            continue
        # The cube root of the rounding error is the best step of a central difference.
        step = 6e-6 * max(abs(float(values[i])), 1e-3 * (c.high - c.low))
        ahead, behind = values.copy(), values.copy()
        ahead[i], behind[i] = min(values[i] + step, c.high), max(values[i] - step, c.low)
        columns.append((curve(ahead) - curve(behind)) / (ahead[i] - behind[i]))
    return np.stack(columns, axis=1)
