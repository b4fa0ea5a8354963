"""Local linear models over the operating point, as gain scheduling uses them.

How their parameters depend on the point is a meta-regression: every estimate is weighted by its own
variance plus a scatter between the points that the regressors do not explain.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy.special

from pamsim.core.encoding import json_key
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.identification.model import FitStatus, IdentifiedModel
from pamsim.identification.optimum import student_quantile

_chi2_tail: Any = scipy.special.chdtrc
_student_cdf: Any = scipy.special.stdtr

_LEVEL = 0.05  # p-value below which a trend is stated


@dataclass(frozen=True)
class OperatingPoint:
    """Where a local model is valid.

    Attributes:
        pressure: mean pressure level [Pa, gauge].
        load: mass on the arm [kg].
        direction: +1 rising, -1 falling, 0 both.
        amplitude: half the peak to peak of the input [input unit].
    """

    pressure: float
    load: float = 0.0
    direction: int = 0
    amplitude: float = 0.0


@dataclass(frozen=True, eq=False)
class LocalModel:
    """A model and the operating point it is valid at."""

    point: OperatingPoint
    fit: IdentifiedModel


@dataclass(frozen=True)
class Trend:
    """Change of a parameter with one regressor, the others held.

    Attributes:
        slope: per SI unit of the regressor; of ln(parameter) if ``logarithmic`` in Dependence.
        interval95: of the slope, lower and upper end.
        p_value: probability of a steeper slope if there is none.
        span: largest minus smallest value of the regressor over the map [SI].
    """

    slope: float
    interval95: tuple[float, float]
    p_value: float
    span: float


@dataclass(frozen=True)
class Dependence:
    """How one parameter changes over the map.

    Attributes:
        parameter: name of the estimate, such as ``K``.
        logarithmic: whether the trends are of ln(parameter), as for time constants.
        mean: over the map, weighted [unit of the parameter].
        points: local models used.
        heterogeneity_p: probability of a larger spread of the estimates against their own intervals
            (Cochran's Q) if all points share one value.
        trends: by regressor; only those that vary over the map and are linearly independent.
        sentence: the same for a person.
    """

    parameter: str
    logarithmic: bool
    mean: float
    points: int
    heterogeneity_p: float = field(metadata=json_key("heterogeneity_p_value"))
    trends: Mapping[str, Trend]
    sentence: str


@dataclass(frozen=True, eq=False)
class LocalModelMap:
    """All local models, in the order given, and how parameters depend on the point.

    Attributes:
        models: one per operating point.
        dependences: one per parameter that at least two converged fits determine.
    """

    models: tuple[LocalModel, ...]
    dependences: tuple[Dependence, ...]


def local_model_map(models: Sequence[LocalModel]) -> LocalModelMap:
    """Regress the parameters of local models on their operating points.

    Only fits with the status ``converged`` enter the regressions; all stay in the table.
    """
    if not models:
        raise InputError("no local models given; give at least one operating point")
    converged = [model for model in models if model.fit.status is FitStatus.CONVERGED]
    names = list(dict.fromkeys(e.name for model in converged for e in model.fit.estimates))
    dependences = (_dependence(name, converged) for name in names)
    return LocalModelMap(tuple(models), tuple(item for item in dependences if item is not None))


def _dependence(name: str, models: Sequence[LocalModel]) -> Dependence | None:
    logarithmic = name[0] in "Twz" and name != "Tz"
    rows: list[tuple[float, float, OperatingPoint]] = []
    for model in models:
        for item in model.fit.estimates:
            if item.name != name or item.interval95 is None:
                continue
            low, high = item.interval95
            if not np.isfinite(high):
                continue
            if logarithmic:
                error = float(np.log(high / low)) / (2.0 * model.fit.quantile)
                rows.append((float(np.log(item.value)), error, model.point))
            elif item.value > low:
                # A dead time's interval may be cut at 0 below: its upper half is whole.
                rows.append((item.value, (high - item.value) / model.fit.quantile, model.point))
    rows = [row for row in rows if np.isfinite(row[1]) and row[1] > 0.0]
    if len(rows) < 2:
        return None
    values, errors = (np.array([row[k] for row in rows]) for k in (0, 1))
    points = [row[2] for row in rows]
    regressors = {
        kind: np.array([float(getattr(point, kind)) for point in points])
        for kind in ("pressure", "load", "direction", "amplitude")
    }
    return dependence(name, values, errors, regressors, logarithmic=logarithmic)


def dependence(
    parameter: str,
    values: FloatArray,
    errors: FloatArray,
    regressors: Mapping[str, FloatArray],
    *,
    logarithmic: bool,
) -> Dependence:
    """Regress estimates, or their logarithms, on the operating point.

    Values and their standard errors are of shape ``(n,)``, n >= 2, as every regressor.

    Source: Cochran's Q; moment estimate of the scatter between points (DerSimonian and Laird
    1986, with regressors: Thompson and Sharp 1999); variance of Knapp and Hartung (2003).
    """
    (mean,), _, spread = _mixed_regression(np.ones((values.size, 1)), values, errors)
    mean = float(np.exp(mean) if logarithmic else mean)
    p_spread = float(_chi2_tail(values.size - 1, spread))
    names = _separable_names(regressors, values.size)
    centred = {name: regressors[name] - np.mean(regressors[name]) for name in names}
    spans = {name: float(np.ptp(regressors[name])) for name in names}
    design = np.column_stack(
        [np.ones(values.size), *(centred[name] / spans[name] for name in names)]
    )
    theta, covariance, _ = _mixed_regression(design, values, errors)
    freedom = values.size - theta.size
    trends: dict[str, Trend] = {}
    for name, change, variance in zip(names, theta[1:], np.diag(covariance)[1:], strict=True):
        error, span = float(np.sqrt(variance)), spans[name]
        half = student_quantile(freedom) * error
        p = 2.0 * float(_student_cdf(freedom, -abs(change) / error))
        ends = (float(change - half) / span, float(change + half) / span)
        trends[name] = Trend(float(change) / span, ends, p, span)
    return Dependence(
        parameter=parameter,
        logarithmic=logarithmic,
        mean=mean,
        points=values.size,
        heterogeneity_p=p_spread,
        trends=trends,
        sentence=_sentence(parameter, mean, p_spread, trends, logarithmic),
    )


def _separable_names(regressors: Mapping[str, FloatArray], n: int) -> list[str]:
    """Return the regressors that vary and are no combination of those before them."""
    kept: list[str] = []
    columns = [np.ones(n)]
    for name, values in regressors.items():
        span = float(np.ptp(values))
        if span <= 1e-9 * max(float(np.max(np.abs(values))), 1e-300) or n < len(columns) + 2:
            continue
        added = np.column_stack([*columns, (values - np.mean(values)) / span])
        if np.linalg.svd(added, compute_uv=False)[-1] > 1e-3:
            columns, kept = [*added.T], [*kept, name]
    return kept


def _mixed_regression(
    design: FloatArray, values: FloatArray, errors: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """Return coefficients and covariance with a scatter between points, and chi-square without."""

    def solved(variances: FloatArray) -> tuple[FloatArray, FloatArray, float]:
        weights = 1.0 / variances
        inverse: Any = np.linalg.inv(design.T @ (weights[:, np.newaxis] * design))
        theta = inverse @ (design.T @ (weights * values))
        left = values - design @ theta
        return theta, inverse, float(np.sum(weights * left**2))

    freedom = values.size - design.shape[1]
    weights = errors**-2.0
    _, inverse, spread = solved(errors**2.0)
    squares = design.T @ (weights[:, np.newaxis] ** 2 * design)
    between = (spread - freedom) / float(np.sum(weights) - np.trace(inverse @ squares))
    theta, inverse, left = solved(errors**2.0 + max(0.0, between))
    # Never narrower than the estimates' own intervals allow.
    return theta, inverse * max(1.0, left / freedom), spread


def _sentence(
    parameter: str, mean: float, p_spread: float, trends: Mapping[str, Trend], logarithmic: bool
) -> str:
    parts: list[str] = []
    for name, trend in trends.items():
        if trend.p_value >= _LEVEL:
            parts.append(f"no significant change with {name} ({_shown(trend.p_value)})")
            continue
        change = trend.slope * trend.span
        share = np.expm1(change) if logarithmic else change / abs(mean)
        verb = "rises" if share > 0.0 else "falls"
        percent = f"{100.0 * abs(share):.0f} %"
        parts.append(f"{verb} by {percent} over the range of {name} ({_shown(trend.p_value)})")
    if not parts:
        parts.append("no regressor varies enough over the map to estimate a trend")
    verdict = "more than their intervals" if p_spread < _LEVEL else "no more than their intervals"
    return f"{parameter}: {'; '.join(parts)}; the estimates differ {verdict} ({_shown(p_spread)})"


def _shown(p_value: float) -> str:
    return f"p = {p_value:.2g}" if p_value >= 1e-3 else "p < 0.001"
