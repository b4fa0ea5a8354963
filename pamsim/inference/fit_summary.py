"""From the ends of all starts to a fit: estimates, intervals, flags, status."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.inference.estimate import Estimate, PriorPull, without_intervals
from pamsim.inference.free_parameter import FreeParameter
from pamsim.inference.identifiability import BoolArray, Identified, identified, parameter_flags
from pamsim.inference.intervals import ParameterCovariance, parameter_covariance
from pamsim.inference.noise_model import rms
from pamsim.inference.search import RowWeights, SearchEnd, short_of_optimum
from pamsim.inference.simulator_fit import (
    ChannelNoise,
    FitStatus,
    Linearisation,
    SimulatorFit,
    StartReport,
)

_SAME_OPTIMUM = 0.1  # of -2 log likelihood: a tenth of what one standard error costs
_SHORT = 2.0
"""Standard errors under white noise: intervals allow for what a search ended short of its optimum,
and beyond this would show more of the search than of the data."""


def summarise_fit(
    cost: RowWeights,
    parameters: Sequence[FreeParameter],
    places: Sequence[FloatArray],
    ends: Sequence[SearchEnd],
    best: SearchEnd,
    jacobian: FloatArray,
) -> SimulatorFit:
    """Summarise a fit whose starts began at some places (p,) of the unit cube.

    The Jacobian is that of the residual at the optimum, per range, (n, p).
    """
    place, scale = best.state.place, cost.residual.scale
    residual = cost.residual.at(place)
    assert residual is not None
    linear = Linearisation(
        places=cost.residual.places,
        residual=residual,
        jacobian=jacobian,
        weight=cost.weight(best.state.noise),
    )
    found = judged(cost, parameters, best, jacobian)
    split = found.split
    spread = parameter_covariance(linear, split.basis, np.diag(found.information))
    # Sticking friction leaves steps in the misfit on which a search ends: how far it ended from
    # the optimum, as the Jacobian shows it, is an error of the estimates.
    away = spread.white @ found.gradient
    spread = replace(spread, matrix=spread.matrix + np.outer(away, away))
    without = split.open | split.at_bound
    slope = np.where(without, np.nan, scale.slope(place))
    covariance = spread.matrix * np.outer(slope, slope)
    errors = np.sqrt(np.diag(covariance))
    with np.errstate(invalid="ignore", divide="ignore"):  # a fit that leaves nothing has no errors
        correlation = covariance / np.outer(errors, errors)
    status, sentence = _status(parameters, split, best, found.short)
    estimates = _parameters(cost, parameters, found, spread, place)
    if status is FitStatus.NOT_CONVERGED:
        estimates = without_intervals(estimates)
    return SimulatorFit(
        parameters=estimates,
        covariance=covariance,
        correlation=correlation,
        determined=split.combinations,
        noise=_noise(cost, best, residual),
        status=status,
        sentence=sentence,
        interval_method=spread.method,
        objective=best.objective,
        evaluations=cost.residual.evaluations,
        calls=cost.residual.calls,
        iterations=sum(end.state.iterations for end in ends),
        diverged=cost.residual.diverged,
        starts=tuple(
            StartReport(
                start=tuple(scale.from_unit(begin).tolist()),
                end=tuple(scale.from_unit(end.state.place).tolist()),
                objective=end.objective,
                converged=end.converged,
                iterations=end.state.iterations,
                same_optimum=end.objective <= best.objective + _SAME_OPTIMUM,
            )
            for begin, end in zip(places, ends, strict=True)
        ),
        linearisation=linear,
    )


@dataclass(frozen=True, kw_only=True)
class Judged:
    """What a Jacobian per range shows of the end of a search."""

    split: Identified  # what is determined
    short: float  # how far off the optimum of that is, see `short_of_optimum`
    gradient: FloatArray  # of half the cost per range, shape (p,)
    information: FloatArray  # of each parameter's prior, per squared range, shape (p,)


def judged(
    cost: RowWeights, parameters: Sequence[FreeParameter], end: SearchEnd, jacobian: FloatArray
) -> Judged:
    """Judge the end of a search by the Jacobian (n, p) of the residual per range there."""
    place, weight = end.state.place, cost.weight(end.state.noise)
    columns, miss = cost.columns(place, weight, jacobian), cost.miss(place, weight)
    assert miss is not None
    information = np.sum(columns[weight.size :] ** 2, axis=0)
    split = identified(parameters, place, columns[: weight.size], information)
    return Judged(
        split=split,
        short=short_of_optimum(columns @ split.basis, miss),
        gradient=columns.T @ miss,
        information=information,
    )


def _parameters(
    cost: RowWeights,
    parameters: Sequence[FreeParameter],
    found: Judged,
    spread: ParameterCovariance,
    place: FloatArray,
) -> tuple[Estimate, ...]:
    scale, split = cost.residual.scale, found.split
    values, slope = scale.from_unit(place), scale.slope(place)
    # Where the data do not depend on a number, a start on a bound was moved off it to no purpose.
    none = split.dead & split.open
    values = np.where(none, [p.start for p in parameters], values)
    error = np.sqrt(np.diag(spread.matrix))
    low = scale.from_unit(np.clip(place - spread.quantile * error, 0.0, 1.0))
    high = scale.from_unit(np.clip(place + spread.quantile * error, 0.0, 1.0))
    some = np.diag(spread.white) > 0.0
    rise = spread.quantile**2 * np.diag(spread.matrix) / np.where(some, np.diag(spread.white), 1.0)
    estimates: list[Estimate] = []
    for i, p in enumerate(parameters):
        flags, partners, sentence = parameter_flags(i, parameters, split, place, spread.matrix)
        known = not (split.open[i] or split.at_bound[i])
        pull = p.prior and PriorPull(
            prior=p.prior,
            distance=float((values[i] - p.prior.mean) / p.prior.standard_deviation),
            share=float(spread.white[i, i] * found.information[i]) if known else None,
        )
        estimates.append(
            Estimate(
                name=p.name,
                unit=p.unit,
                value=float(values[i]),
                interval95=(float(low[i]), float(high[i])) if known else None,
                standard_error=float(slope[i] * error[i]) if known else None,
                rise95=float(rise[i]) if known else None,
                bounds=(p.low, p.high),
                flags=flags,
                partners=partners,
                sentence=sentence,
                prior=pull,
            )
        )
    return tuple(estimates)


def _noise(cost: RowWeights, best: SearchEnd, residual: FloatArray) -> dict[str, ChannelNoise]:
    return {
        channel: ChannelNoise(
            standard_deviation=best.state.noise[channel],
            source=cost.noise.source(channel),
            rms=rms(residual, places),
            rms_per_trial={
                trial: rms(residual, [p for p in places if p.block.trial == trial])
                for trial in dict.fromkeys(p.block.trial for p in places)
            },
        )
        for channel, places in cost.noise.channels.items()
    }


def _status(
    parameters: Sequence[FreeParameter], split: Identified, best: SearchEnd, short: float
) -> tuple[FitStatus, str]:
    def names(chosen: BoolArray) -> str:
        return ", ".join(p.name for p, c in zip(parameters, chosen, strict=True) if c)

    if not best.converged:
        return FitStatus.NOT_CONVERGED, (
            f"the search ran out of steps after {best.state.steps}; allow more or start nearer"
        )
    if short > _SHORT:
        return FitStatus.NOT_CONVERGED, (
            f"the search stopped {short:.2g} standard errors short of the optimum that its last"
            " Jacobian shows: the simulation is not smooth there, or differences are too noisy"
        )
    if np.any(split.open):
        sentence = f"these trials do not determine {names(split.open)}"
        if split.combinations:
            sentence += f", only {' and '.join(split.combinations)}"
        return FitStatus.NOT_IDENTIFIABLE, (
            sentence + "; hold some of them, give them priors, or measure what separates them"
        )
    if np.any(split.at_bound):
        return FitStatus.AT_BOUND, (
            f"{names(split.at_bound)} ran into the allowed range, which then decides, not the data"
        )
    return FitStatus.CONVERGED, "no parameter at a limit"
