"""Fit a model to rows of a table and predict every row from a fit that has not seen it.

Rows have no order in time and no repeats: each is its own trial, and leaving one out at a time is
all the holding out that there can be.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy.optimize
from numpy.typing import NDArray
from scipy.stats import t as student

from pamsim.core.errors import InputError
from pamsim.sysid.free_parameter import FreeParameter, SearchScale

FloatArray = NDArray[np.float64]
Values = Mapping[str, float]
PredictRows = Callable[[Sequence[Values]], Sequence[FloatArray | None]]
"""Rig parameters by name [SI], those left out at the rig's own values, to simulated minus measured
of every row, shape (n,); None where there is no prediction."""

# scipy carries no types: what it returns is Any at this file's boundary.
_least_squares: Any = scipy.optimize.least_squares
_bounded_linear: Any = scipy.optimize.lsq_linear

_STEP = 1e-4  # of a range, for differences
_LOST = 1e2  # factor on the residual where there is no prediction
_TOLERANCE = 1e-4
_FOLLOWED = 2  # starts that are followed to their end, of those tried
_INSIDE = 1e-3  # of a range, that starts keep from its ends
_BLIND = 1e-9  # rad per range: a parameter that moves no row
_ROUNDS = 6  # of a refit without a row
_SETTLED = 1e-4  # change of a place in its range that ends it


@dataclass
class RowSimulator:
    """A handed-in predictor of rows, its predictions counted.

    Attributes:
        predict: see `PredictRows`.
        anchor: makes the predictions exact at given values, where ``predict`` is an approximation
            that is better the nearer; None where it is exact everywhere.
        evaluations: parameter sets predicted so far.
    """

    predict: PredictRows
    anchor: Callable[[Values], None] | None = None
    evaluations: int = 0

    def many(self, sets: Sequence[Values]) -> list[FloatArray | None]:
        """Residuals of several parameter sets."""
        self.evaluations += len(sets)
        return [
            None if found is None or not np.all(np.isfinite(found)) else found
            for found in self.predict(sets)
        ]


@dataclass(frozen=True, kw_only=True)
class RowFit:
    """A model fitted to all rows.

    Attributes:
        parameters: p of them.
        values: name -> value [SI].
        residual: simulated minus measured, (n,) [SI].
        jacobian: change of the residual per range of each parameter, (n, p).
    """

    parameters: tuple[FreeParameter, ...]
    values: dict[str, float]
    residual: FloatArray
    jacobian: FloatArray = field(repr=False)

    @property
    def rms(self) -> float:
        """Root mean square of the residual [SI]."""
        return float(np.sqrt(np.mean(self.residual**2)))

    @property
    def place(self) -> FloatArray:
        """Of the values in their ranges, (p,)."""
        vector = np.array([self.values[p.name] for p in self.parameters])
        return SearchScale(self.parameters).to_unit(vector)

    @property
    def at_bound(self) -> tuple[str, ...]:
        """Names that ended on their range's ends."""
        ends = np.minimum(self.place, 1.0 - self.place) < _INSIDE
        return tuple(p.name for p, end in zip(self.parameters, ends, strict=True) if end)


@dataclass(frozen=True, kw_only=True)
class LeftOutRows:
    """Errors at rows that a fit has not seen.

    Attributes:
        residual: simulated minus measured, each row by the fit without it, (n,) [SI].
        values: of those fits, (n, p) [SI].
        settled: largest last change of a parameter, in units of its range.
    """

    residual: FloatArray
    values: FloatArray
    settled: float

    @property
    def rms(self) -> float:
        """Root mean square over the rows [SI]."""
        return float(np.sqrt(np.mean(self.residual**2)))

    def reach95(self) -> FloatArray:
        """Half widths of the parameters' jackknife intervals (Tukey 1958), (p,) [SI].

        They hold for rows that err by different amounts, as those of a model that lacks an effect.
        """
        count, free = self.values.shape
        scatter = np.sum((self.values - self.values.mean(axis=0)) ** 2, axis=0)
        return float(student.ppf(0.975, max(count - free, 1))) * np.sqrt(
            (count - 1) / count * scatter
        )


def fit_rows(
    simulator: RowSimulator,
    parameters: Sequence[FreeParameter],
    starts: Sequence[Values],
    *,
    most: int = 15,
) -> RowFit | None:
    """Least squares within the ranges, the best from several starts.

    Args:
        simulator: of the rows.
        parameters: p of them; none gives the model as it is.
        starts: values of all parameters to begin from [SI]; the nearest are followed.
        most: steps tried from each.

    Returns:
        The fit; None if there is no prediction at any start.
    """
    parameters = tuple(parameters)
    if not parameters:
        (found,) = simulator.many([{}])
        if found is None:
            return None
        return RowFit(parameters=(), values={}, residual=found, jacobian=np.empty((found.size, 0)))
    if len(starts) > _FOLLOWED:
        first = simulator.many(starts)
        costs = [np.inf if r is None else float(r @ r) for r in first]
        starts = [starts[i] for i in np.argsort(costs, kind="stable")[:_FOLLOWED]]
    best: RowFit | None = None
    for start in starts:
        found = _fit_from(simulator, parameters, start, most)
        if found is not None and (best is None or found.rms < best.rms * (1.0 - 1e-6)):
            best = found
    return best


def _fit_from(
    simulator: RowSimulator, parameters: tuple[FreeParameter, ...], start: Values, most: int
) -> RowFit | None:
    scale = SearchScale(parameters)
    names = [p.name for p in parameters]
    begin = scale.to_unit(np.array([start[name] for name in names]))
    begin = np.clip(begin, _INSIDE, 1.0 - _INSIDE)

    def at(places: FloatArray) -> list[FloatArray | None]:
        return simulator.many(
            [dict(zip(names, v, strict=True)) for v in scale.from_unit(places).tolist()]
        )

    (first,) = at(begin[np.newaxis])
    if first is None:
        return None
    lost = _LOST * np.maximum(np.abs(first), np.max(np.abs(first)))
    seen: dict[bytes, FloatArray] = {begin.tobytes(): first}

    def residual(place: FloatArray) -> FloatArray:
        key = place.tobytes()
        if key not in seen:
            found = at(place[np.newaxis])[0]
            seen[key] = lost if found is None else found
        return seen[key]

    def jacobian(place: FloatArray) -> FloatArray:
        middle = residual(place)
        steps = np.where(place > 0.5, -_STEP, _STEP)
        moved = at(place + np.diag(steps))
        columns = [
            np.zeros_like(middle) if found is None else (found - middle) / step
            for found, step in zip(moved, steps, strict=True)
        ]
        return np.stack(columns, axis=1)

    found = _least_squares(
        residual, begin, jac=jacobian, bounds=(0.0, 1.0), x_scale="jac",
        ftol=_TOLERANCE, xtol=_TOLERANCE, gtol=1e-12, max_nfev=most,
    )  # fmt: skip
    place = _onto_ends(found.x, residual)
    return RowFit(
        parameters=parameters,
        values=dict(zip(names, scale.from_unit(place).tolist(), strict=True)),
        residual=residual(place),
        jacobian=jacobian(place),
    )


def _onto_ends(place: FloatArray, residual: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """Put what has come close to an end of its range onto it, if that is no worse.

    The solver stays inside by design and approaches an end without ever reaching it.
    """
    near = np.minimum(place, 1.0 - place) < _INSIDE
    if not np.any(near):
        return place
    onto = np.where(near, np.round(place), place)
    old, new = residual(place), residual(onto)
    return onto if float(new @ new) <= float(old @ old) * (1.0 + 1e-6) else place


def linearised_left_out(fit: RowFit) -> FloatArray:
    """Errors at unseen rows from the fit's own slopes, without another prediction, (n,) [SI].

    Each row's refit is the bounded linear problem of the other rows.
    """
    place, count = fit.place, fit.residual.size
    found = fit.residual.copy()
    for i in range(count):
        keep = np.arange(count) != i
        step = _bounded_step(fit.jacobian[keep], fit.residual[keep], place)
        found[i] += float(fit.jacobian[i] @ step)
    return found


def linearised_reach95(fit: RowFit) -> FloatArray:
    """Half widths of the parameters' intervals from the fit's own slopes, (p,) [SI].

    They take the rows' errors as independent and alike; infinite for what the rows do not tell.
    """
    count, free = fit.jacobian.shape
    variance = float(fit.residual @ fit.residual) / max(count - free, 1)
    covariance = np.linalg.pinv(fit.jacobian.T @ fit.jacobian, rcond=1e-12) * variance
    reach = float(student.ppf(0.975, max(count - free, 1))) * np.sqrt(np.diag(covariance))
    blind = np.linalg.norm(fit.jacobian, axis=0) < _BLIND
    return np.where(blind, np.inf, reach * SearchScale(fit.parameters).slope(fit.place))


def left_out(simulator: RowSimulator, fit: RowFit) -> LeftOutRows:
    """Refit without each row in turn, all refits predicted in one call per round.

    Every refit is a Gauss-Newton iteration within the ranges, with the slopes of the common
    optimum, which is close to its own.

    Args:
        simulator: of the rows.
        fit: to all of them.

    Raises:
        InputError: if the rows are too few, or a refit leaves what can be predicted.
    """
    count, free = fit.jacobian.shape
    if count <= free + 1:
        raise InputError(f"{count} rows less one do not determine {free} parameters")
    if free == 0:
        return LeftOutRows(residual=fit.residual, values=np.empty((count, 0)), settled=0.0)
    scale = SearchScale(fit.parameters)
    names = [p.name for p in fit.parameters]
    at = np.tile(fit.place, (count, 1))
    residual = np.tile(fit.residual, (count, 1))
    change = np.inf
    for _ in range(_ROUNDS):
        moved = at.copy()
        for i in range(count):
            keep = np.arange(count) != i
            moved[i] += _bounded_step(fit.jacobian[keep], residual[i, keep], at[i])
        change = float(np.max(np.abs(moved - at)))
        at = moved
        sets = [dict(zip(names, v, strict=True)) for v in scale.from_unit(at).tolist()]
        for i, found in enumerate(simulator.many(sets)):
            if found is None:
                raise InputError(f"without row {i + 1} the fit leaves what can be predicted")
            residual[i] = found
        if change < _SETTLED:
            break
    return LeftOutRows(
        residual=np.diag(residual).copy(), values=scale.from_unit(at), settled=change
    )


def _bounded_step(jacobian: FloatArray, residual: FloatArray, place: FloatArray) -> FloatArray:
    """Step that least squares take from a place, to no place outside 0 ... 1, (p,)."""
    free: FloatArray = np.asarray(np.linalg.lstsq(jacobian, -residual, rcond=None)[0], dtype=float)
    if np.all((place + free >= 0.0) & (place + free <= 1.0)):
        return free
    ends = (np.minimum(-place, -1e-12), np.maximum(1.0 - place, 1e-12))
    return _bounded_linear(jacobian, -residual, bounds=ends, method="bvls").x
