"""Whether to trust the numbers of a fit: one list of rules for every structure and kind of data."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from pamsim.identification.continuous import BEYOND, LEAST_DAMPING, ContinuousStructure
from pamsim.identification.discrete import DiscreteStructure
from pamsim.identification.model import FitStatus, IdentifiedModel, pole_names
from pamsim.identification.records import (
    Data,
    FrequencyRecord,
    SignalRecord,
    inputs_repeat,
    time_range,
)

_VAGUE = 3.0  # factor up or down, beyond which a parameter of the poles is not known
_EQUAL = 1e-6  # of logarithms of time constants: a search resolves no smaller difference
_AT_BOUND = 1e-3  # distance from the bound of a logarithm
_LOST = 5.0  # points of fit percent from prediction to free run
_LEVEL = 0.05  # p-value above which chance explains a gain
_CORRELATED = 0.5  # of residuals at one sample, from which white intervals are too narrow


class Verdict(NamedTuple):
    """On a fit; fields of `IdentifiedModel`, by default those of one that a rule objects to."""

    sentence: str
    status: FitStatus = FitStatus.DEGENERATE
    refuted: bool = False


def judged(fit: IdentifiedModel, data: Data, latest: Mapping[int, float], white: bool) -> Verdict:
    """Judge a fit to data; the first rule that objects decides.

    ``latest`` holds the upper end of each dead time that was found to be 0, by input [s]: 0 where
    it would lie below. ``white`` is whether the intervals take the residuals to be white.
    """
    for objection in _objections(fit, data):
        return objection
    sentence = "; ".join(["converged inside the bounds", *_notes(fit, latest, white)])
    return Verdict(sentence, FitStatus.CONVERGED)


def _objections(fit: IdentifiedModel, data: Data) -> Iterator[Verdict]:
    if not fit.settled:
        why = "the solver ran out of evaluations before it converged"
        yield Verdict(why, FitStatus.NOT_CONVERGED)
    structure, records = fit.structure, None if isinstance(data, FrequencyRecord) else data
    if isinstance(structure, DiscreteStructure):
        if any(abs(z) >= 1.0 for z in fit.poles):
            yield Verdict("a pole lies on or outside the unit circle: the free run does not settle")
        if structure.kind == "arx" and fit.covariance is None:
            yield Verdict(
                f"the records do not determine {structure.sentence}: directions are not excited;"
                " give an input that changes more often, or lower the order"
            )
    elif records is not None:
        yield from _out_of_range(fit, structure, *time_range(records))
        yield from _undamped(fit, structure, time_range(records)[1])
        yield from _repeated(fit, structure, records)
    if fit.covariance is None:
        yield Verdict("the Jacobian is singular: parameters are not identifiable")
    if isinstance(structure, DiscreteStructure):
        return
    if records is not None and structure.order + structure.integrators == 0:
        yield from _best_of_many(fit, structure, records)
    if structure.integrators and records is not None:
        yield from _cancelled_integrator(fit, structure, time_range(records)[1])
    if isinstance(data, FrequencyRecord):
        yield from _not_measured(fit, structure, data)
    if len(_idle(fit)) == structure.inputs:
        yield Verdict(
            "the interval of the gain contains 0: the input explains nothing of the output, or "
            "the records are too short to show where it settles"
        )
    yield from _merged(fit, structure)
    yield from _vague(fit, structure)


def _out_of_range(
    fit: IdentifiedModel, structure: ContinuousStructure, shortest: float, longest: float
) -> Iterator[Verdict]:
    """Time constants below a sample time [s], or far above a duration [s]."""
    constants = structure.constants(fit.coordinates)
    sizes = np.abs(constants)
    # An oscillation is resolved up to half the sampling rate.
    if np.any(sizes < np.where(np.imag(constants) == 0.0, shortest, shortest / np.pi)):
        yield Verdict(
            f"time constant {np.min(sizes):.3g} s is shorter than one sample ({shortest:.3g} s): "
            "the records do not resolve it, lower the order"
        )
    if np.any(np.log(100.0 * longest) - np.log(sizes) < _AT_BOUND):
        yield Verdict(
            f"time constant {np.max(sizes):.3g} s is at its upper bound, a hundred records long: "
            "the output does not settle, or integrates",
            FitStatus.AT_BOUND,
        )


def _undamped(
    fit: IdentifiedModel, structure: ContinuousStructure, duration: float
) -> Iterator[Verdict]:
    """An oscillation that lasts longer than the records, which do not show its damping.

    With a command that repeats itself such poles lie at its harmonics, where they imitate what is
    not linear: however well that fits, another structure is to be chosen. Of a pair slower than the
    records no period is seen: it stands for a drift.
    """
    for pair in range(structure.pairs):
        wn, zeta = np.exp(fit.coordinates[2 * pair : 2 * pair + 2])
        half = fit.half_width(fit.unit(2 * pair + 1))
        at_bound = np.log(zeta / LEAST_DAMPING) < _AT_BOUND
        vague = at_bound or half is None or half > np.log(_VAGUE)
        if vague and wn * duration > 2.0 * np.pi and zeta * wn * duration < 1.0:
            yield Verdict(
                f"zeta = {zeta:.3g}: the oscillation at {wn:.3g} rad/s lasts longer than the"
                " records, which do not show its damping; lower the order",
                refuted=True,
            )


def _repeated(
    fit: IdentifiedModel, structure: ContinuousStructure, records: Sequence[SignalRecord]
) -> Iterator[Verdict]:
    """A dead time after which the inputs are what they were, or their mirror image."""
    for i, delay in enumerate(map(float, structure.delays(fit.coordinates))):
        if delay > 0.0 and all(inputs_repeat(record, i, delay) for record in records):
            yield Verdict(
                f"L{structure.marks[i]} = {delay:.3g} s: after this time the inputs repeat"
                " themselves, or their mirror image, so that the records do not determine it;"
                " leave it out, or give a command that does not repeat",
                refuted=True,
            )


def _not_measured(
    fit: IdentifiedModel, structure: ContinuousStructure, data: FrequencyRecord
) -> Iterator[Verdict]:
    """A pole where a response was not measured, or a dead time that it does not show."""
    w = data.frequency
    poles = 1.0 / np.abs(structure.constants(fit.coordinates))
    outside = [pole for pole in poles if not w[0] / BEYOND < pole < w[-1] * BEYOND]
    if outside:
        yield Verdict(
            f"a pole at {min(outside):.3g} rad/s lies far outside the measured frequencies"
            f" ({w[0]:.3g} to {w[-1]:.3g} rad/s): lower the order, or measure there"
        )
    if structure.dead_time and fit.dead_time <= 0.0:
        yield Verdict("no dead time is detected: leave it out")


def _best_of_many(
    fit: IdentifiedModel, structure: ContinuousStructure, records: Sequence[SignalRecord]
) -> Iterator[Verdict]:
    """A late gain no larger than chance makes that of the best of all dead times (Bonferroni)."""
    tried = max(record.output.size for record in records)
    for place, i in structure.delay_places.items():
        gain, late = structure.coefficients(i).start, float(fit.coordinates[place])
        half = fit.half_width(fit.unit(gain))
        if late <= 0.0 or not half:
            continue
        errors = fit.quantile * abs(float(fit.coordinates[gain])) / half
        if tried * math.erfc(errors / math.sqrt(2.0)) > _LEVEL:
            yield Verdict(
                f"L{structure.marks[i]} = {late:.3g} s: the best of {tried} dead times has such a"
                " gain by chance alone: the input explains nothing of the output",
                refuted=True,
            )


def _cancelled_integrator(
    fit: IdentifiedModel, structure: ContinuousStructure, duration: float
) -> Iterator[Verdict]:
    numerators = [structure.coefficients(i) for i in range(structure.inputs)]
    gains = [abs(float(fit.coordinates[places.start])) for places in numerators]
    halves = [fit.half_width(fit.unit(places.start)) for places in numerators]
    if all(half is not None and b < half for b, half in zip(gains, halves, strict=True)):
        yield Verdict(
            "the interval of the gain contains 0, so that a zero cancels an integrator: the records"
            " do not show that the output integrates"
        )
    zeros = [np.roots(fit.coordinates[places][::-1]) for places in numerators]
    if all(np.any(np.abs(one) * duration < 1.0) for one in zeros):
        yield Verdict(
            "a zero slower than the longest record cancels an integrator: the records do not show "
            "that the output integrates so often"
        )


def _merged(fit: IdentifiedModel, structure: ContinuousStructure) -> Iterator[Verdict]:
    """Two real time constants that the data do not separate."""
    x = fit.coordinates
    rising = np.argsort(x[: structure.order], kind="stable") if structure.real_lags else ()
    for low, high in pairwise(map(int, rising)):
        # The cost is even in d = log(T2/T1), so d^2 is the parameter with a regular estimate, and
        # its standard deviation is 2 d spread: two of them reach zero when d < 4 spread.
        half = fit.half_width(fit.unit(high) - fit.unit(low))
        if half is not None and x[high] - x[low] < max(4.0 * half / fit.quantile, _EQUAL):
            yield Verdict(
                f"time constants {np.exp(x[low]):.3g} s and {np.exp(x[high]):.3g} s merge within "
                "their uncertainty: the records show a double lag or an oscillation; allow "
                "complex poles or lower the order"
            )


def _vague(fit: IdentifiedModel, structure: ContinuousStructure) -> Iterator[Verdict]:
    for name, unit, i in pole_names(structure, fit.coordinates):
        half = fit.half_width(fit.unit(i))
        if half is not None and half > np.log(_VAGUE):
            shown = f"{name} = {np.exp(fit.coordinates[i]):.3g} {unit}".removesuffix(" -")
            yield Verdict(
                f"{shown} is known to no better than a factor of {_VAGUE:g}: more poles or "
                "zeros than the records show, lower the order"
            )


def _notes(fit: IdentifiedModel, latest: Mapping[int, float], white: bool) -> Iterator[str]:
    """What a reader should know of a fit that can be trusted."""
    for i in _idle(fit):
        yield f"input {i} explains nothing of the output, its gain may be 0"
    for i, end in latest.items():
        several = len(fit.units_input) > 1
        if end > 0.0:
            which = f" of input {i + 1}" if several else ""
            yield f"no dead time{which} is detected, it is below {end:.3g} s"
        else:
            given = f"input {i + 1}" if several else "the input"
            yield f"the output leads {given}; check the order of the rows"
    if fit.disagreement is not None and not fit.weighted:
        yield (
            "weighting by the noise model moves the estimates too far, so the "
            "structure is wrong somewhere: the estimates that simulate best are kept"
        )
    one_step = fit.fit_percent_one_step
    lost = 0.0 if one_step is None else one_step - fit.fit_percent
    if lost > _LOST:
        yield (
            f"the free run fits {lost:.0f} points worse than the one-step prediction: the noise"
            " is not that of ARX and biases the poles, prefer output error"
        )
    if None in fit.continuous_poles:
        yield "a pole <= 0 has no continuous equivalent (often noise, or too high an order)"
    lag1 = max((score.residual_lag1 for score in fit.trials), default=0.0)
    if white and lag1 > _CORRELATED:
        yield f"residuals are correlated (lag 1: {lag1:.2f}), the intervals are too narrow"


def _idle(fit: IdentifiedModel) -> list[int]:
    """Inputs, counted from 1, whose coefficients together are within their uncertainty of 0.

    By Wald's test.
    """
    structure, covariance = fit.structure, fit.covariance
    if covariance is None or isinstance(structure, DiscreteStructure):
        return []
    found: list[int] = []
    for i in range(structure.inputs):
        places = structure.coefficients(i)
        b, own = fit.coordinates[places], covariance[places, places]
        if np.any(b[np.diag(own) == 0.0] != 0.0):  # held
            continue
        solved: Any = np.linalg.lstsq(own, b, rcond=None)[0]
        # The square of the quantile is that of one coefficient; of several the sum must be larger.
        if float(b @ solved) < fit.quantile**2 * b.size:
            found.append(i + 1)
    return found
