"""Continuous-time models from general inputs by output error, several trials at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.linear.continuous_estimates import continuous_estimates, continuous_status
from pamsim.linear.continuous_structure import ContinuousStructure
from pamsim.linear.identified_model import IdentifiedModel, score_trials
from pamsim.linear.noise_weighted_fit import NoiseWeightedFit, noise_weighted_fit
from pamsim.linear.optimum import Optimum
from pamsim.linear.signal_record import SignalRecord, checked_records

FloatArray = NDArray[np.float64]

# Counts of start values per pole coordinate: fewer where the combinations multiply.
_LAGS = {0: 1, 1: 12, 2: 8, 3: 7, 4: 6, 5: 6, 6: 6}
_DAMPING = (0.15, 0.5, 1.2)
_DELAYS = 7


def fit_continuous(
    records: Sequence[SignalRecord],
    *,
    order: int,
    zeros: int = 0,
    dead_time: bool = False,
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
        zeros: number of zeros, at most that of all poles.
        dead_time: True estimates a dead time, any fraction of a sample.
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
    structure = ContinuousStructure(order, zeros, dead_time, real_lags, start, integrators, drift)
    trials = checked_records(records)
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
    at, latest_dead_time = _optimum(fit), None
    if dead_time and structure.delay(fit.solution.x) <= 0.0:
        # The data show no delay that is below 0: the rest is fitted without it.
        half = at.half_width(at.unit(order))
        if half is not None:
            # Less than half a sample is not resolved, however narrow the interval.
            latest_dead_time = max(structure.delay(fit.solution.x) + half, 0.5 * shortest)
        simpler = replace(structure, dead_time=False)
        fit = noise_weighted_fit(simpler.problem(trials), [fit.solution.x[:order]])
        evaluations += fit.solution.evaluations
        at = _with_dead_time_of_zero(_optimum(fit), order)
    status, sentence = continuous_status(structure, at, fit, shortest, longest, latest_dead_time)
    unit_input, unit_output = trials[0].unit_input, trials[0].unit_output
    return IdentifiedModel(
        structure=structure,
        coordinates=at.coordinates,
        covariance=at.covariance,
        estimates=continuous_estimates(
            structure, at, f"{unit_output}/{unit_input}", unit_input, latest_dead_time
        ),
        **score_trials(structure, at.coordinates, trials, held_out),
        noise=fit.noise,
        weighted=fit.weighted,
        status=status,
        sentence=sentence,
        evaluations=evaluations,
        unit_input=unit_input,
        unit_output=unit_output,
    )


def _optimum(fit: NoiseWeightedFit) -> Optimum:
    coordinates = np.concatenate([fit.solution.x, fit.solution.theta])
    return Optimum(coordinates, fit.covariance, fit.quantile)


def _with_dead_time_of_zero(at: Optimum, place: int) -> Optimum:
    """Insert a dead time of 0 that was held: its row and column of the covariance are 0."""
    covariance = at.covariance
    if covariance is not None:
        covariance = np.insert(np.insert(covariance, place, 0.0, axis=0), place, 0.0, axis=1)
    return Optimum(np.insert(at.coordinates, place, 0.0), covariance, at.quantile)


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
    return [np.array([*p, delay]) for p, delay in product(poles, delays)]
