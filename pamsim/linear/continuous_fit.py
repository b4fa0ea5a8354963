"""Continuous-time models from general inputs by output error, several trials at once."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.linear.continuous_estimates import Located, continuous_estimates, judged
from pamsim.linear.continuous_result import ContinuousFit as ContinuousFit
from pamsim.linear.continuous_structure import STARTS, ContinuousStructure
from pamsim.linear.estimate import pooled_fit_percent, trial_score
from pamsim.linear.noise_weighted_fit import NoiseWeightedFit, noise_weighted_fit
from pamsim.linear.separable_fit import Separable
from pamsim.linear.signal_record import SignalRecord, checked_records

FloatArray = NDArray[np.float64]

# Counts of start values per pole coordinate: fewer where the combinations multiply.
_LAGS = {1: 12, 2: 8, 3: 7, 4: 6, 5: 6}
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
    held_out: Sequence[SignalRecord] = (),
) -> ContinuousFit:
    """Fit one linear model with shared dynamics to all trials by its free run.

    Before a record its input is taken to have been ``input[0]``. Each trial has an offset of its
    own. Time constants are sought between a tenth of the shortest sample and a hundred times the
    longest record, a dead time between 0 and half the shortest record, from a fixed grid of
    starts: the result does not depend on chance.

    Args:
        records: the trials; sample times may differ.
        order: number of poles, 1 to 5.
        zeros: number of zeros, less than ``order``.
        dead_time: True estimates a dead time, any fraction of a sample.
        real_lags: True seeks real time constants, False any stable poles as (wn, zeta) pairs.
        start: ``rest``: at rest at the first sample; ``free``: an initial state for each trial.
        held_out: trials that are only simulated.

    Returns:
        The fit with its status; a status other than ``converged`` means: do not quote the numbers.

    Raises:
        InputError: bad order, zeros or start, no records, repeated names, too few samples.
    """
    if start not in STARTS:
        raise InputError(f"start {start!r} is not known; give one of {', '.join(STARTS)}")
    structure = ContinuousStructure(order, zeros, dead_time, real_lags)
    trials = checked_records(records)
    both = checked_records([*trials, *held_out])
    longest = max(record.duration for record in trials)
    unknowns = structure.searched + zeros + 1 + (1 if start == "rest" else 1 + order) * len(trials)
    samples = sum(record.output.size for record in trials)
    if samples < 3 * unknowns:
        raise InputError(
            f"{samples} samples are too few for {unknowns} unknowns; record longer or lower the "
            "order"
        )
    fit = noise_weighted_fit(separable(structure, trials, start), _starts(structure, trials))
    evaluations = fit.solution.evaluations
    at = _located(structure, fit)
    if dead_time and structure.delay(fit.solution.x) <= 0.0:
        # A delay below 0 is one that the data do not show: the rest is fitted without it.
        half = at.width(at.unit(order))
        latest = None if half is None else max(structure.delay(fit.solution.x) + half, 0.0)
        simpler = ContinuousStructure(order, zeros, False, real_lags)
        problem = separable(simpler, trials, start)
        fit = noise_weighted_fit(problem, [fit.solution.x[:order]])
        evaluations += fit.solution.evaluations
        at = _without_dead_time(structure, fit, latest)
    coordinates = at.coordinates
    runs = {record.name: structure.free_run(coordinates, record, start) for record in both}
    scores = [trial_score(record, *runs[record.name]) for record in both]
    tested = both[len(trials) :]
    status, sentence = judged(at, fit, min(r.sample_time for r in trials), longest)
    units = trials[0].unit_input, trials[0].unit_output
    return ContinuousFit(
        structure=structure,
        coordinates=coordinates,
        covariance=at.covariance,
        estimates=continuous_estimates(at, f"{units[1]}/{units[0]}"),
        trials=tuple(scores[: len(trials)]),
        held_out=tuple(scores[len(trials) :]),
        fit_percent=pooled_fit_percent([(r.output, runs[r.name][0]) for r in trials]),
        fit_percent_held_out=pooled_fit_percent([(r.output, runs[r.name][0]) for r in tested])
        if tested
        else None,
        noise=fit.noise,
        weighted=fit.weighted,
        start=start,
        status=status,
        sentence=sentence,
        evaluations=evaluations,
        unit_input=units[0],
        unit_output=units[1],
    )


def separable(
    structure: ContinuousStructure, records: Sequence[SignalRecord], start: str
) -> Separable:
    """Return the least-squares problem of a structure: x its poles and dead time, theta b0..bm."""
    shortest = min(record.sample_time for record in records)
    longest = max(record.duration for record in records)
    low, high = np.log(0.1 * shortest), np.log(100.0 * longest)
    lower, upper = [low] * structure.order, [high] * structure.order
    for pair in range(structure.pairs):
        lower[2 * pair], upper[2 * pair] = -high, -low
        lower[2 * pair + 1], upper[2 * pair + 1] = np.log(1e-3), np.log(1e2)
    if structure.dead_time:
        # One sample below 0, so that a search for a small delay does not crawl along a bound.
        lower = [*lower, -shortest]
        upper = [*upper, 0.5 * min(record.duration for record in records)]
    return Separable(
        outputs=tuple(record.output for record in records),
        shared=lambda x, i: structure.responses(x, records[i]),
        own=lambda x, i: structure.unknown_start(x, records[i], start),
        lower=np.array(lower),
        upper=np.array(upper),
    )


def _located(structure: ContinuousStructure, fit: NoiseWeightedFit) -> Located:
    both = np.concatenate([fit.solution.x, fit.solution.theta])
    return Located(structure, both, fit.covariance, fit.quantile)


def _without_dead_time(
    structure: ContinuousStructure, fit: NoiseWeightedFit, latest: float | None
) -> Located:
    """Insert a dead time of 0 that was held: its row and column of the covariance are 0."""
    place = structure.order
    both = np.concatenate([fit.solution.x, [0.0], fit.solution.theta])
    covariance = fit.covariance
    if covariance is not None:
        covariance = np.insert(np.insert(covariance, place, 0.0, axis=0), place, 0.0, axis=1)
    return Located(structure, both, covariance, fit.quantile, latest)


def _starts(structure: ContinuousStructure, records: Sequence[SignalRecord]) -> list[FloatArray]:
    shortest = min(record.sample_time for record in records)
    longest = max(record.duration for record in records)
    logs = np.linspace(np.log(2.0 * shortest), np.log(0.5 * longest), _LAGS[structure.order])
    poles: list[tuple[float, ...]]
    if structure.pairs == 0:
        # Apart, since the cost has a saddle where time constants are equal.
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
