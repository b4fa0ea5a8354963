"""Continuous-time models from general inputs by output error, several trials at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations, product

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.linear.continuous_estimates import continuous_estimates, continuous_status
from pamsim.linear.continuous_structure import ContinuousStructure
from pamsim.linear.identified_model import IdentifiedModel, score_trials
from pamsim.linear.noise_weighted_fit import NoiseWeightedFit, noise_weighted_fit
from pamsim.linear.optimum import Optimum
from pamsim.linear.signal_record import SignalRecord, checked_records

# Counts of start values per pole coordinate: fewer where the combinations multiply.
_LAGS = {0: 1, 1: 12, 2: 8, 3: 7, 4: 6, 5: 6, 6: 6}
_DAMPING = (0.15, 0.5, 1.2)
_DELAYS = 7


def fit_continuous(
    records: Sequence[SignalRecord],
    *,
    order: int,
    zeros: int | tuple[int, ...] = 0,
    dead_time: bool = False,
    undelayed: tuple[int, ...] = (),
    real_lags: bool = True,
    start: str = "rest",
    integrators: int = 0,
    drift: bool = False,
    starts: Sequence[FloatArray] = (),
    held_out: Sequence[SignalRecord] = (),
) -> IdentifiedModel:
    """Fit one linear model with shared dynamics to all trials by its free run.

    Before a record its input is taken to have been ``input[0]``. Each trial has an offset of its
    own. Time constants are sought between a tenth of the shortest sample and a hundred times the
    longest record, a dead time between 0 and half the shortest record, from a fixed grid of
    starts or from those given: the result is reproducible.

    Args:
        records: the trials; sample times may differ.
        order: number of poles that are no integrators, 0 to 6.
        zeros: number of zeros, at most that of all poles; of each input, or one number for all.
        dead_time: True estimates the dead time of every input, any fraction of a sample.
        undelayed: places of inputs that have none nevertheless.
        real_lags: True seeks real time constants, False any stable poles as (wn, zeta) pairs.
        start: ``rest``: at rest at the first sample; ``free``: an initial state for each trial.
        integrators: number of poles at 0, 0 to 2.
        drift: whether each output drifts along a line of its own.
        starts: where to begin the search: poles and dead time as `ContinuousStructure` orders
            them, each of shape ``(searched,)``.
        held_out: trials that are only simulated.

    Returns:
        The model with its status; do not quote the numbers unless that is ``converged``.

    Raises:
        InputError: bad order, zeros or start, no records, repeated names, too few samples.
    """
    trials = checked_records(records)
    structure = ContinuousStructure(
        order=order,
        zeros=zeros if isinstance(zeros, int) else max(zeros),
        dead_time=dead_time,
        real_lags=real_lags,
        start=start,
        integrators=integrators,
        drift=drift,
        inputs=len(trials[0].units_input),
        undelayed=undelayed,
        zeros_each=() if isinstance(zeros, int) else zeros,
    )
    held_out = checked_records([*trials, *held_out])[len(trials) :]
    shortest = min(record.sample_time for record in trials)
    longest = max(record.duration for record in trials)
    unknowns = structure.unknowns + structure.per_trial * len(trials)
    samples = sum(record.output.size for record in trials)
    if samples < 3 * unknowns:
        raise InputError(
            f"{samples} samples are too few for {unknowns} unknowns; record longer or lower the "
            "order"
        )
    fit = noise_weighted_fit(structure.problem(trials), starts or _starts(structure, trials))
    evaluations = fit.solution.evaluations
    at, latest = _optimum(fit), dict[int, float]()
    while structure.undelayed != (none := _undelayed(structure, fit)):
        # The data show no delay that is below 0: the rest is fitted without it.
        for place, i in enumerate(structure.delayed, start=order):
            half = at.half_width(at.unit(place))
            if i in none and half is not None:
                # Less than half a sample is not resolved, however narrow the interval.
                latest[i] = max(float(at.coordinates[place]) + half, 0.5 * shortest)
        shown = [place for place, i in enumerate(structure.delayed, start=order) if i in none]
        structure = replace(structure, undelayed=none)
        fit = noise_weighted_fit(structure.problem(trials), [np.delete(fit.solution.x, shown)])
        evaluations += fit.solution.evaluations
        at = _optimum(fit)
    at = _with_dead_times_of_zero(at, structure, undelayed)
    structure = replace(structure, undelayed=undelayed)
    status, sentence = continuous_status(structure, at, fit, shortest, longest, latest)
    units_input, unit_output = trials[0].units_input, trials[0].unit_output
    return IdentifiedModel(
        structure=structure,
        coordinates=at.coordinates,
        covariance=at.covariance,
        quantile=at.quantile,
        estimates=continuous_estimates(structure, at, unit_output, units_input, latest),
        **score_trials(structure, at.coordinates, trials, held_out),
        noise=fit.noise,
        weighted=fit.weighted,
        status=status,
        sentence=sentence,
        evaluations=evaluations,
        units_input=units_input,
        unit_output=unit_output,
    )


def _optimum(fit: NoiseWeightedFit) -> Optimum:
    coordinates = np.concatenate([fit.solution.x, fit.solution.theta])
    return Optimum(coordinates, fit.covariance, fit.quantile)


def _undelayed(structure: ContinuousStructure, fit: NoiseWeightedFit) -> tuple[int, ...]:
    """Inputs whose dead time is 0: it was held there, or the fit puts it there or below."""
    found = zip(structure.delayed, fit.solution.x[structure.order :], strict=True)
    return tuple(sorted([*structure.undelayed, *(i for i, delay in found if delay <= 0.0)]))


def _with_dead_times_of_zero(
    at: Optimum, structure: ContinuousStructure, undelayed: tuple[int, ...]
) -> Optimum:
    """Insert dead times that were held at 0: their rows and columns of the covariance are 0."""
    coordinates, covariance = at.coordinates, at.covariance
    every = [i for i in range(structure.inputs) if i not in undelayed]
    for place, i in enumerate(every, start=structure.order):
        if i not in structure.undelayed:
            continue
        coordinates = np.insert(coordinates, place, 0.0)
        if covariance is not None:
            covariance = np.insert(np.insert(covariance, place, 0.0, axis=0), place, 0.0, axis=1)
    return Optimum(coordinates, covariance, at.quantile)


def _starts(structure: ContinuousStructure, records: Sequence[SignalRecord]) -> list[FloatArray]:
    shortest = min(record.sample_time for record in records)
    longest = max(record.duration for record in records)
    logs = np.linspace(np.log(2.0 * shortest), np.log(0.5 * longest), _LAGS[structure.order])
    poles: list[tuple[float, ...]]
    if structure.pairs == 0:
        # Distinct, since the cost has a saddle where time constants are equal.
        poles = list(combinations(map(float, logs), structure.order))
    else:
        damping = [float(np.log(zeta)) for zeta in _DAMPING]
        single = structure.order - 2 * structure.pairs
        poles = [
            (*(v for pair in zip(rates, zetas, strict=True) for v in pair), *lags)
            for rates in combinations(map(float, -logs), structure.pairs)
            for zetas in product(damping, repeat=structure.pairs)
            for lags in product(map(float, logs), repeat=single)
        ]
    if not structure.dead_time:
        return [np.array(p) for p in poles]
    most = 0.25 * min(record.duration for record in records)
    delays = [0.0, *np.geomspace(1.5 * shortest, max(most, 3.0 * shortest), _DELAYS)]
    late = delay_starts(delays, len(structure.delayed))
    return [np.append(p, delay) for p, delay in product(poles, late)]


def delay_starts(delays: Sequence[float], count: int) -> list[FloatArray]:
    """Return dead times to start a search from: all equal, and one longer than the others.

    Args:
        delays: to try, the shortest first [s].
        count: of the inputs with a dead time.

    Returns:
        Each of shape ``(count,)`` [s].
    """
    equal = [np.full(count, delay) for delay in delays]
    if count < 2:
        return equal
    return equal + [
        np.where(np.arange(count) == i, delay, delays[0])
        for i in range(count)
        for delay in delays[1:]
    ]
