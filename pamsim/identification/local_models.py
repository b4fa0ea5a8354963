"""Local linear models over the operating point, as gain scheduling uses them.

Trials whose input is held long enough are cut into their steps, each a point.

How their parameters depend on the point is a meta-regression: every estimate is weighted by its own
variance plus a scatter between the points that the regressors do not explain.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy.special

from pamsim.core.computation import Progress
from pamsim.core.digits import p_in_words
from pamsim.core.encoding import json_key
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.identification.continuous import ContinuousStructure
from pamsim.identification.fit import fit as fit_model
from pamsim.identification.model import FitStatus, IdentifiedModel
from pamsim.identification.optimum import student_quantile
from pamsim.identification.records import FEWEST_SAMPLES, SignalRecord
from pamsim.identification.signals import SignalTable, UsedTrial

_chi2_tail: Any = scipy.special.chdtrc
_student_cdf: Any = scipy.special.stdtr

_LEVEL = 0.05  # p-value below which a trend is stated
_LONG_ENOUGH = 2.0  # slowest time constants that a held input must last to show a gain
_LEAD = 0.2  # share of the plateau before a step that shows where it starts from
_LEVEL_GRID = 2e3  # [Pa]: levels of one step differ by less, from sensor noise
_SETTLED = 0.05  # change over that share, against the step's own, from which it had not settled
_MOST = 100  # points with a model of their own: enough for how they depend on four quantities


@dataclass(frozen=True)
class OperatingPoint:
    """Where a local model is valid."""

    pressure: float  # mean pressure level [Pa, gauge]
    load: float = 0.0  # mass on the arm [kg]
    direction: int = 0  # +1 rising, -1 falling, 0 both
    amplitude: float = 0.0  # half the peak to peak of the input [input unit]


@dataclass(frozen=True, eq=False)
class LocalModel:
    """A model and the operating point it is valid at."""

    point: OperatingPoint
    fit: IdentifiedModel


@dataclass(frozen=True)
class Trend:
    """Change of a parameter with one regressor, the others held."""

    slope: float  # per SI unit of the regressor; of ln(parameter) if ``logarithmic`` in Dependence
    interval95: tuple[float, float]  # of the slope, lower and upper end
    p_value: float  # probability of a steeper slope if there is none
    span: float  # largest minus smallest value of the regressor over the map [SI]


@dataclass(frozen=True)
class Dependence:
    """How one parameter changes over the map."""

    parameter: str  # name of the estimate, such as ``K``
    logarithmic: bool  # whether the trends are of ln(parameter), as for time constants
    mean: float  # over the map, weighted [unit of the parameter]
    points: int  # local models used
    # probability of a larger spread of the estimates against their own intervals (Cochran's Q) if
    # all points share one value
    heterogeneity_p: float = field(metadata=json_key("heterogeneity_p_value"))
    # by regressor; only those that vary over the map and are linearly independent
    trends: Mapping[str, Trend]
    sentence: str  # the same for a person


@dataclass(frozen=True, eq=False)
class LocalModelMap:
    """All local models, in the order given, and how parameters depend on the point."""

    models: tuple[LocalModel, ...]  # one per operating point
    # one per parameter that at least two converged fits determine
    dependences: tuple[Dependence, ...]


Piece = tuple[SignalRecord, OperatingPoint]


def fit_operating_points(
    trials: Sequence[UsedTrial],
    fit: IdentifiedModel,
    progress: Progress | None = None,
) -> tuple[LocalModelMap | None, list[str]]:
    """Fit the structure of a model of one input again at every operating point.

    A trial whose input is held long enough to settle is cut into its steps, others stay whole.
    The same step of trials that repeat each other (same protocol and load) is one point. Of more
    than a hundred points some are drawn.

    Returns:
        The map, or None for fewer than two points; and notes on steps that were not used.
    """
    structure = fit.structure
    assert isinstance(structure, ContinuousStructure)
    if structure.integrators:
        return None, ["no model for each operating point: the output integrates"]
    slowest = structure.slowest(fit.coordinates)
    groups: dict[tuple[str, float, int, int], list[Piece]] = {}
    notes: list[str] = []
    for trial in trials:
        for index, piece in _pieces(trial, slowest, notes):
            key = (trial.table.protocol, trial.table.load, index, piece[1].direction)
            groups.setdefault(key, []).append(piece)
    if len(groups) < 2:
        return None, notes
    points = list(groups.values())
    if len(points) > _MOST:
        notes.append(f"of {len(points)} operating points {_MOST}, drawn at random, have a model")
        # Not every tenth: in a record of steps to and fro all of those may go one way.
        drawn = np.random.default_rng(0).choice(len(points), _MOST, replace=False)
        points = [points[k] for k in np.sort(drawn)]
    models: list[LocalModel] = []
    for done, group in enumerate(points):
        if progress is not None:
            progress(done, len(points), "operating points")
        try:
            local = fit_model([record for record, _ in group], structure)
        except InputError as error:
            notes.append(f"{group[0][0].name}: no model of its own: {error}")
            continue
        mean = {
            name: float(np.mean([getattr(point, name) for _, point in group]))
            for name in ("pressure", "amplitude")
        }
        models.append(LocalModel(replace(group[0][1], **mean), local))
    return (local_model_map(models) if len(models) > 1 else None), notes


def _pieces(trial: UsedTrial, slowest: float, notes: list[str]) -> list[tuple[int, Piece]]:
    """Steps of a record with their index, or the record itself with index 0."""
    table, record, into = trial.table, trial.record, trial.record.input
    changes = np.flatnonzero(np.diff(into) != 0.0) + 1
    ends = np.append(changes[1:], into.size)
    cut = record.holds == ("zoh",) and changes.size > 1
    if not cut or np.min(ends - changes) * record.sample_time < _LONG_ENOUGH * slowest:
        # Of a single step; 0 for an input that goes both ways.
        direction = int(np.sign(into[-1] - into[0])) if changes.size == 1 else 0
        return [(0, _piece(table, record, direction))]
    pieces: list[tuple[int, Piece]] = []
    for index, (change, end) in enumerate(zip(changes, ends, strict=True)):
        before = changes[index - 1] if index else 0
        first = change - max(1, round(_LEAD * (change - before)))
        if end - first < FEWEST_SAMPLES:
            notes.append(f"{table.name}: step {index + 1} is too short for a model of its own")
            continue
        lead = record.output[first:change]
        # Means of the two halves, so that noise is not taken for drift.
        halves = np.array_split(lead, 2) if lead.size > 1 else [lead, lead]
        # From before the step: a direct path moves the output in the first sample already.
        moved = record.output[end - 1] - np.mean(halves[1])
        if abs(np.mean(halves[1]) - np.mean(halves[0])) > _SETTLED * abs(moved):
            notes.append(f"{table.name}: before step {index + 1} the output had not settled")
        try:
            step = record.part(slice(int(first), int(end)), name=f"{table.name} step {index + 1}")
        except InputError as error:
            notes.append(f"{table.name}: step {index + 1} is not used: {error}")
            continue
        direction = int(np.sign(into[change] - into[change - 1]))
        pieces.append((index, _piece(table, step, direction)))
    return pieces or [(0, _piece(table, record, 0))]


def _piece(table: SignalTable, record: SignalRecord, direction: int) -> Piece:
    inside = (table.time >= record.time[0]) & (table.time <= record.time[-1])
    level = 0.0 if table.level is None else float(np.mean(table.level[inside]))
    point = OperatingPoint(
        # Rounded, so that sensor noise does not make levels differ.
        pressure=_LEVEL_GRID * round(level / _LEVEL_GRID),
        load=table.load,
        direction=direction,
        amplitude=0.5 * float(np.ptp(record.input)),
    )
    return record, point


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
            parts.append(f"no significant change with {name} ({p_in_words(trend.p_value)})")
            continue
        change = trend.slope * trend.span
        share = np.expm1(change) if logarithmic else change / abs(mean)
        verb = "rises" if share > 0.0 else "falls"
        percent = f"{100.0 * abs(share):.0f} %"
        parts.append(f"{verb} by {percent} over the range of {name} ({p_in_words(trend.p_value)})")
    if not parts:
        parts.append("no regressor varies enough over the map to estimate a trend")
    more = "more" if p_spread < _LEVEL else "no more"
    parts.append(f"the estimates differ {more} than their intervals ({p_in_words(p_spread)})")
    return f"{parameter}: {'; '.join(parts)}"
