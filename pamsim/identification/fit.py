"""Fit a linear model to data: step responses, any inputs, ARX, output error, frequency responses.

A structure and the data give what differs between them: the least-squares problem and where
its search begins. The search, the model of the noise, the intervals and the rules by which numbers
are trusted are the same for all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.identification.continuous import ContinuousStructure
from pamsim.identification.discrete import Structure
from pamsim.identification.model import FitStatus, IdentifiedModel, TrialScore, estimates_of
from pamsim.identification.optimum import Optimum
from pamsim.identification.records import (
    Data,
    FrequencyRecord,
    SignalRecord,
    checked_records,
    fit_percent,
    pooled_fit_percent,
    time_range,
)
from pamsim.identification.separable import Held, Separable
from pamsim.identification.starts import starts_of
from pamsim.identification.status import judged
from pamsim.identification.weighted_fit import Weights, fit_separable


def fit(
    data: Data,
    structure: Structure,
    *,
    held: Mapping[str, float] | None = None,
    starts: Sequence[FloatArray] = (),
    held_out: Sequence[SignalRecord] = (),
    white: bool = False,
) -> IdentifiedModel:
    """Fit one linear model, of as many inputs as the trials have, with shared dynamics.

    Of trials each has an offset of its own, and sample times may differ; before a record its input
    is taken to have been ``inputs[0]``. A continuous model and output error are fitted by their
    free run, ARX by its one-step prediction. Of a frequency response the relative error is
    minimised, with equal weight for every frequency; the fit is 100 % less its RMS.

    Args:
        data: trials, or a frequency response.
        structure: which model.
        held: name -> value that is known and not fitted: the gain ``K``, or the ``offset`` of every
            trial [SI].
        starts: where to begin the search, each of shape ``(structure.searched,)``; from a fixed
            grid if left out, so that the result is reproducible.
        held_out: trials that are only simulated.
        white: whether the intervals take the noise to be white, as those of ARX always do.

    Returns:
        The model with its status; do not quote the numbers unless that is ``converged``.

    Raises:
        InputError: for no records, repeated names, too few samples, a name that cannot be held, or
            data that the structure is not for.
    """
    weights = Weights.WHITE if white or structure.kind == "arx" else Weights.NOISE
    if isinstance(data, FrequencyRecord):
        weights = Weights.EQUAL
    else:
        data = checked_records(data)
        held_out = checked_records([*data, *held_out])[len(data) :]
    problem, known = structure.problem(data), structure.held(held or {})
    _require_samples(data, structure)
    pinned = _by_whole_samples(structure, data)
    at = _searched(problem, known, starts or starts_of(structure, data), weights, pinned)
    latest: dict[int, float] = {}
    absent: dict[int, int] = {}
    while not isinstance(data, FrequencyRecord) and (late := _not_shown(structure, at, absent)):
        for place, i in late.items():
            half = at.half_width(at.unit(place))
            if half is not None:
                # Less than half a sample is not resolved, however narrow the interval.
                least = 0.5 * time_range(data)[0]
                end = float(at.coordinates[place]) + half
                latest[i] = 0.0 if end < -least else max(end, least)
        # The rest is fitted without a delay that the data do not show.
        absent |= late
        rest = replace(structure, undelayed=(*structure.undelayed, *absent.values()))
        start = np.delete(at.coordinates[: structure.searched], [*absent])
        at = _searched(rest.problem(data), known, [start], weights, pinned)
        back = np.delete(np.eye(structure.unknowns), [*absent], axis=1)
        at = at.moved(np.zeros(structure.unknowns), back)
    if pinned and at.covariance is not None and not isinstance(data, FrequencyRecord):
        # All delays within one sample are the same to a held input.
        half = 0.5 * time_range(data)[0]
        shown = [place for place in range(structure.searched) if place not in absent]
        at.covariance[shown, shown] = (half / at.quantile) ** 2
    facts = _facts(data, structure, at, held_out, problem, known)
    units = facts.get("unit_output", "-"), facts.get("units_input", ("-",))
    found = IdentifiedModel(
        **vars(at),
        **facts,
        structure=structure,
        estimates=tuple(
            replace(one, held=True, interval95=None) if one.name in (held or {}) else one
            for one in estimates_of(structure, at, *units, latest)
        ),
        status=FitStatus.CONVERGED,
        sentence="",
    )
    return replace(found, **judged(found, data, latest, white)._asdict())


def _by_whole_samples(structure: Structure, data: Data) -> bool:
    """Whether the output has no slope along dead times: a gain repeats a held input's samples."""
    return (
        isinstance(structure, ContinuousStructure)
        and structure.order + structure.integrators == 0
        and not isinstance(data, FrequencyRecord)
        and all(record.holds[i] == "zoh" for record in data for i in structure.delayed)
    )


def _searched(
    problem: Separable,
    known: Held,
    starts: Sequence[FloatArray],
    weights: Weights,
    pinned: bool = False,
) -> Optimum:
    """The optimum, all that is held included.

    With ``pinned`` x has no slope, so that the best of the starts is where the search ends. Its
    variance is 0.
    """
    at = fit_separable(problem.holding(known), starts, weights)
    if pinned and problem.lower.size:
        x = at.coordinates[: problem.lower.size]
        rest = replace(
            problem,
            shared=lambda _, i: problem.shared(x, i),
            own=lambda _, i: problem.own(x, i),
            lower=np.empty(0),
            upper=np.empty(0),
        )
        at = fit_separable(rest.holding(known), [np.empty(0)], weights)
        count = at.coordinates.size
        at = at.moved(np.append(x, np.zeros(count)), np.eye(x.size + count, count, -x.size))
    return at if known.nothing else known.optimum(at)


def _not_shown(structure: Structure, at: Optimum, but: Mapping[int, int]) -> dict[int, int]:
    """Place of each other dead time whose interval contains 0, or that lies below -> its input."""
    if not isinstance(structure, ContinuousStructure):
        return {}
    return {
        place: i
        for place, i in structure.delay_places.items()
        if place not in but and at.coordinates[place] <= (at.half_width(at.unit(place)) or 0.0)
    }


def _require_samples(data: Data, structure: Structure) -> None:
    if isinstance(data, FrequencyRecord):
        unknowns, samples, what = structure.unknowns, 2 * data.frequency.size, "frequencies"
    else:
        unknowns = structure.counted(len(data))
        samples, what = sum(record.output.size for record in data), "samples"
    if samples < 3 * unknowns:
        count = samples if what == "samples" else samples // 2
        raise InputError(
            f"{count} {what} are too few for {unknowns} unknowns; record longer or lower the order"
        )


def _facts(
    data: Data,
    structure: Structure,
    at: Optimum,
    held_out: Sequence[SignalRecord],
    problem: Separable,
    known: Held,
) -> dict[str, Any]:
    """Scores of a model's free run, and its units: these fields of `IdentifiedModel`."""
    x = at.coordinates
    if isinstance(data, FrequencyRecord):
        response = structure.frequency_response(x, data.frequency)
        miss = float(np.sqrt(np.mean(np.abs(response / data.response - 1.0) ** 2)))
        return {"trials": (), "fit_percent": 100.0 * (1.0 - miss)}
    continuous = isinstance(structure, ContinuousStructure)
    drifts = continuous and structure.drift
    rests = not drifts and not (continuous and structure.integrators)
    scores: list[TrialScore] = []
    pairs: list[tuple[FloatArray, FloatArray]] = []
    levels: list[float] = []
    for record in (*data, *held_out):
        # Of a trial that was not fitted the offset is not known.
        offset = known.offset if len(scores) < len(data) else None
        run, own = structure.free_run(x, record, offset=offset)
        scores.append(_score(record, run, own, drifts))
        pairs.append((record.output, run))
        levels.append(float(own[0] - record.inputs[0] @ structure.static_gains(x)))
    count = len(data)
    one_step = None
    if structure.kind == "arx":
        left = problem.holding(known).linear_part(np.empty(0)).residual
        ends = np.cumsum([output.size for output in problem.outputs])[:-1]
        parts = zip(problem.outputs, np.split(left, ends), strict=True)
        one_step = pooled_fit_percent([(output, output - part) for output, part in parts])
    return {
        "level": float(np.mean(levels[:count])) if rests else None,
        "trials": tuple(scores[:count]),
        "held_out": tuple(scores[count:]),
        "fit_percent": pooled_fit_percent(pairs[:count]),
        "fit_percent_held_out": pooled_fit_percent(pairs[count:]) if held_out else None,
        "fit_percent_one_step": one_step,
        "units_input": data[0].units_input,
        "unit_output": data[0].unit_output,
    }


def _score(record: SignalRecord, run: FloatArray, own: FloatArray, drifts: bool) -> TrialScore:
    with np.errstate(over="ignore", invalid="ignore"):
        residual = record.output - run
        square = float(residual @ residual)
        lag1 = float(residual[1:] @ residual[:-1]) / square if square > 0.0 else 0.0
        rms = float(np.sqrt(np.mean(residual**2)))
    return TrialScore(
        name=record.name,
        samples=record.output.size,
        offset=float(own[0]),
        fit_percent=fit_percent(record.output, run),
        rms=rms,
        residual_lag1=lag1,
        drift=float(own[1]) if drifts else None,
    )
