"""Continuous-time models from general inputs by output error, several trials at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations, pairwise, product
from typing import Any

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.identification.continuous_structure import ContinuousStructure
from pamsim.identification.identified_model import (
    NOT_SETTLED,
    SINGULAR,
    FitStatus,
    IdentifiedModel,
    score_trials,
)
from pamsim.identification.noise_weighted_fit import NoiseWeightedFit, noise_weighted_fit
from pamsim.identification.optimum import Optimum
from pamsim.identification.signal_record import SignalRecord, checked_records, time_range
from pamsim.inference.estimate import Estimate, Interval

# Counts of start values per pole coordinate: fewer where the combinations multiply.
_LAGS = {0: 1, 1: 12, 2: 8, 3: 7, 4: 6, 5: 6, 6: 6}
_DAMPING = (0.15, 0.5, 1.2)
_DELAYS = 7
VAGUE = 3.0
"""Factor up or down, beyond which a parameter of the poles is not known."""
_AT_BOUND = 1e-3  # distance from the bound of a logarithm


def fit_continuous(
    records: Sequence[SignalRecord],
    *,
    zeros: int | tuple[int, ...] = 0,
    starts: Sequence[FloatArray] = (),
    held_out: Sequence[SignalRecord] = (),
    **which: Any,
) -> IdentifiedModel:
    """Fit one linear model with shared dynamics to all trials by its free run.

    Args:
        records: the trials; sample times may differ.
        zeros: number of zeros, at most that of all poles; of each input, or one number for all.
        starts: where to begin the search: poles and dead time as the structure orders them, each
            of shape ``(searched,)``.
        held_out: trials that are only simulated.
        which: ``order`` and other attributes of `ContinuousStructure`, but for the inputs.

    Returns:
        The model with its status; do not quote the numbers unless that is ``converged``.

    Raises:
        InputError: bad order, zeros or start, no records, repeated names, too few samples.
    """
    trials = checked_records(records)
    each = () if isinstance(zeros, int) else zeros
    structure = ContinuousStructure(
        zeros=zeros if isinstance(zeros, int) else max(zeros),
        zeros_each=each,
        inputs=len(trials[0].units_input),
        **which,
    )
    return fit_structure(trials, structure, starts, held_out)


def fit_structure(
    records: Sequence[SignalRecord],
    structure: ContinuousStructure,
    starts: Sequence[FloatArray] = (),
    held_out: Sequence[SignalRecord] = (),
) -> IdentifiedModel:
    """Fit a structure, of as many inputs as the trials have, to all of them by its free run.

    Before a record its input is taken to have been ``input[0]``. Each trial has an offset of its
    own. Time constants are sought between a tenth of the shortest sample and a hundred times the
    longest record, a dead time between 0 and half the shortest record, from a fixed grid of
    starts or from those given: the result is reproducible. Held-out trials are only simulated.
    """
    trials = checked_records(records)
    held_out = checked_records([*trials, *held_out])[len(trials) :]
    shortest, longest = time_range(trials)
    unknowns = structure.unknowns + structure.per_trial * len(trials)
    samples = sum(record.output.size for record in trials)
    if samples < 3 * unknowns:
        raise InputError(
            f"{samples} samples are too few for {unknowns} unknowns; record longer or lower the "
            "order"
        )
    fit = noise_weighted_fit(structure.problem(trials), starts or _starts(structure, trials))
    evaluations = fit.solution.evaluations
    at, latest = fit.optimum, dict[int, float]()
    order, undelayed = structure.order, structure.undelayed
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
        at = fit.optimum
    at = _with_dead_times_of_zero(at, structure, undelayed)
    structure = replace(structure, undelayed=undelayed)
    status, sentence = _status(structure, at, fit, shortest, longest, latest)
    units_input, unit_output = trials[0].units_input, trials[0].unit_output
    return IdentifiedModel(
        **vars(at),
        **score_trials(structure, at.coordinates, trials, held_out),
        structure=structure,
        estimates=continuous_estimates(structure, at, unit_output, units_input, latest),
        noise=fit.noise,
        weighted=fit.weighted,
        status=status,
        sentence=sentence,
        evaluations=evaluations,
    )


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
    shortest, longest = time_range(records)
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

    Those to try begin with the shortest; each result is of shape ``(count,)`` [s].
    """
    equal = [np.full(count, delay) for delay in delays]
    if count < 2:
        return equal
    return equal + [
        np.where(np.arange(count) == i, delay, delays[0])
        for i in range(count)
        for delay in delays[1:]
    ]


def continuous_estimates(
    structure: ContinuousStructure,
    at: Optimum,
    unit_output: str,
    units_input: Sequence[str],
    latest_dead_times: Mapping[int, float],
) -> tuple[Estimate, ...]:
    """Return gain, time constants or (wn, zeta), zeros and dead time with 95 % intervals.

    Of several inputs K, zeros and dead time carry the input's number: ``K[1]``. Of an integrating
    model K is the gain from the input to the output's rate (or its rate), and ``u0`` the input at
    which the output does not run away; of several inputs ``r0`` is that rate where all are 0.

    Intervals of positive parameters are symmetric in the logarithm.

    ``latest_dead_times`` are the upper ends of the intervals of dead times that were estimated as 0
    and held there, by input [s].
    """
    x = at.coordinates
    numbers = [f"[{i + 1}]" for i in range(structure.inputs)] if structure.inputs > 1 else [""]
    firsts = [structure.coefficients(i).start for i in range(structure.inputs)]
    per_time = ("", "/s", "/s^2")[structure.integrators]
    result: list[Estimate] = []
    for number, first, unit in zip(numbers, firsts, units_input, strict=True):
        ratio = "-" if unit_output == unit == "-" else f"{unit_output}/{unit}"
        unit_gain = ratio + per_time
        result.append(at.estimate(f"K{number}", unit_gain, float(x[first]), at.unit(first)))
    for name, unit, i in _pole_names(structure, x):
        result.append(at.estimate(name, unit, float(np.exp(x[i])), at.unit(i), positive=True))
    for number, first, zeros in zip(numbers, firsts, structure.numerator_zeros, strict=True):
        for power in range(1, zeros + 1):
            name = "Tz" if zeros == 1 else f"c{power}"
            unit = "s" if power == 1 else f"s^{power}"
            result.append(at.estimate(name + number, unit, *at.ratio(first + power, first)))
    if structure.biased:
        last = x.size - 1
        if structure.inputs > 1:
            unit = unit_output + per_time
            result.append(at.estimate("r0", unit, float(x[last]), at.unit(last)))
        else:
            ratio, gradient = at.ratio(last, firsts[0])
            result.append(at.estimate("u0", units_input[0], -ratio, -gradient))
    delays = structure.delays(x)
    for place, i in enumerate(structure.delayed, start=structure.order):
        delay, half = float(delays[i]), at.half_width(at.unit(place))
        sides: Interval | None = None
        if i in latest_dead_times:
            sides = (0.0, latest_dead_times[i])
        elif half is not None:
            sides = (max(delay - half, 0.0), delay + half)
        result.append(Estimate(name=f"L{numbers[i]}", unit="s", value=delay, interval95=sides))
    return tuple(result)


def _status(
    structure: ContinuousStructure,
    at: Optimum,
    fit: NoiseWeightedFit,
    shortest: float,
    longest: float,
    latest_dead_times: Mapping[int, float],
) -> tuple[FitStatus, str]:
    """Whether to trust a fit, and why."""
    x = at.coordinates
    if not fit.solution.settled:
        return NOT_SETTLED
    constants = structure.constants(x)
    sizes = np.abs(constants)
    # An oscillation is resolved up to half the sampling rate.
    resolved = np.where(np.imag(constants) == 0.0, shortest, shortest / np.pi)
    if np.any(sizes < resolved):
        return FitStatus.DEGENERATE, (
            f"time constant {np.min(sizes):.3g} s is shorter than one sample ({shortest:.3g} s): "
            "the records do not resolve it, lower the order"
        )
    if sizes.size and np.log(100.0 * longest) - np.log(np.max(sizes)) < _AT_BOUND:
        return FitStatus.AT_BOUND, (
            f"time constant {np.max(sizes):.3g} s is at its upper bound, a hundred records long: "
            "the output does not settle, or integrates"
        )
    if at.covariance is None:
        return SINGULAR
    each = [structure.coefficients(i) for i in range(structure.inputs)]
    if structure.integrators and all(contains_zero(at, places.start) for places in each):
        return FitStatus.DEGENERATE, (
            "the interval of the gain contains 0, so that a zero cancels an integrator: the records"
            " do not show that the output integrates"
        )
    if structure.integrators and all(
        np.any(np.abs(np.roots(x[places][::-1])) * longest < 1.0) for places in each
    ):
        return FitStatus.DEGENERATE, (
            "a zero slower than the longest record cancels an integrator: the records do not show "
            "that the output integrates so often"
        )
    idle = [i for i, places in enumerate(each, start=1) if _numerator_may_be_zero(at, places)]
    if len(idle) == structure.inputs:
        return FitStatus.DEGENERATE, (
            "the interval of the gain contains 0: the input explains nothing of the output, or "
            "the records are too short to show where it settles"
        )
    pair = merged_lags(structure, at)
    if pair is not None:
        return FitStatus.DEGENERATE, (
            f"time constants {pair[0]:.3g} s and {pair[1]:.3g} s merge within "
            "their uncertainty: the records show a double lag or an oscillation; allow "
            "complex poles or lower the order"
        )
    vague = vague_parameter(structure, at)
    if vague is not None:
        name, value, unit = vague
        shown = f"{name} = {value:.3g}" + ("" if unit == "-" else f" {unit}")
        return FitStatus.DEGENERATE, (
            f"{shown} is known to no better than a factor of {VAGUE:g}: more poles or "
            "zeros than the records show, lower the order"
        )
    sentence = "converged inside the bounds"
    for i in idle:
        sentence += f"; input {i} explains nothing of the output, its gain may be 0"
    for i, latest in latest_dead_times.items():
        of = f" of input {i + 1}" if structure.inputs > 1 else ""
        sentence += f"; no dead time{of} is detected, it is below {latest:.3g} s"
    if fit.disagreement is not None and not fit.weighted:
        sentence += (
            "; weighting by the noise model moves the estimates too far, so the "
            "structure is wrong somewhere: the estimates that simulate best are kept"
        )
    return FitStatus.CONVERGED, sentence


def contains_zero(at: Optimum, i: int) -> bool:
    """Whether the interval of a coordinate contains 0."""
    half = at.half_width(at.unit(i))
    return half is not None and abs(float(at.coordinates[i])) < half


def _numerator_may_be_zero(at: Optimum, places: slice) -> bool:
    """Whether all coefficients together are within their uncertainty of 0 (Wald's test)."""
    if at.covariance is None:
        return False
    b = at.coordinates[places]
    solved: Any = np.linalg.lstsq(at.covariance[places, places], b, rcond=None)[0]
    # The square of the quantile is that of one coefficient; of several the sum must be larger.
    return float(b @ solved) < at.quantile**2 * b.size


def merged_lags(structure: ContinuousStructure, at: Optimum) -> tuple[float, float] | None:
    """Return two real time constants that the data do not separate, or None [s]."""
    if not structure.real_lags:
        return None
    x = at.coordinates
    rising = np.argsort(x[: structure.order], kind="stable")
    for low, high in pairwise(map(int, rising)):
        # The cost is even in d = log(T2/T1), so d^2 is the parameter with a regular estimate, and
        # its standard deviation is 2 d spread: two of them reach zero when d < 4 spread.
        half = at.half_width(at.unit(high) - at.unit(low))
        if half is not None and x[high] - x[low] < 4.0 * half / at.quantile:
            return float(np.exp(x[low])), float(np.exp(x[high]))
    return None


def vague_parameter(structure: ContinuousStructure, at: Optimum) -> tuple[str, float, str] | None:
    """Return name, value and unit of the first pole parameter with too wide an interval."""
    for name, unit, i in _pole_names(structure, at.coordinates):
        half = at.half_width(at.unit(i))
        if half is not None and half > np.log(VAGUE):
            return name, float(np.exp(at.coordinates[i])), unit
    return None


def _pole_names(structure: ContinuousStructure, x: FloatArray) -> list[tuple[str, str, int]]:
    """Return name, unit and coordinate of each pole parameter; lags rise, pairs by rising wn."""
    pairs = sorted(range(structure.pairs), key=lambda pair: float(x[2 * pair]))
    number = [str(k + 1) if structure.pairs > 1 else "" for k in range(structure.pairs)]
    result: list[tuple[str, str, int]] = []
    for suffix, pair in zip(number, pairs, strict=True):
        result += [(f"wn{suffix}", "rad/s", 2 * pair), (f"zeta{suffix}", "-", 2 * pair + 1)]
    lags = sorted(range(2 * structure.pairs, structure.order), key=lambda i: float(x[i]))
    for k, i in enumerate(lags):
        result.append((f"T{k + 1}" if len(lags) > 1 else "T", "s", i))
    return result
