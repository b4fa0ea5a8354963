"""Whether to trust the numbers of a fit: one list of rules for every structure and kind of data."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.identification.continuous import BEYOND, LEAST_DAMPING, ContinuousStructure
from pamsim.identification.estimates import VAGUE, merged_lags, vague_parameter
from pamsim.identification.optimum import Optimum
from pamsim.identification.records import Data, FrequencyRecord, inputs_repeat, time_range
from pamsim.identification.structure import Structure
from pamsim.identification.weighted_fit import SearchedFit

_AT_BOUND = 1e-3  # distance from the bound of a logarithm
_LOST = 5.0  # points of fit percent from prediction to free run
_CORRELATED = 0.5  # of residuals at one sample, from which white intervals are too narrow


class FitStatus(StrEnum):
    """Whether the numbers of a fit can be trusted."""

    CONVERGED = "converged"
    AT_BOUND = "at_bound"
    NOT_CONVERGED = "not_converged"
    DEGENERATE = "degenerate"


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """A fit as the rules look at it.

    Attributes:
        structure: which model.
        at: its coordinates.
        run: how they were searched.
        data: what was fitted.
        latest: upper end of each dead time that was found to be 0, by input [s].
        lost: points of fit percent that a free run loses against the one-step prediction.
        white: whether the intervals take the residuals to be white.
        lag1: largest autocorrelation of a trial's residual at one sample.
    """

    structure: Structure
    at: Optimum
    run: SearchedFit
    data: Data
    latest: Mapping[int, float]
    lost: float
    white: bool
    lag1: float

    @property
    def x(self) -> FloatArray:
        """Coordinates."""
        return self.at.coordinates

    @property
    def continuous(self) -> ContinuousStructure | None:
        """The structure, if it is a continuous one."""
        return self.structure if isinstance(self.structure, ContinuousStructure) else None

    @property
    def sizes(self) -> FloatArray:
        """Size of each time constant of a continuous model [s]."""
        return np.abs(self.continuous.constants(self.x)) if self.continuous else np.empty(0)

    @property
    def range(self) -> tuple[float, float] | None:
        """Shortest sample time and longest record; None of a frequency response [s]."""
        return None if isinstance(self.data, FrequencyRecord) else time_range(self.data)

    @property
    def numerators(self) -> list[slice]:
        """Places of every input's coefficients of a continuous model."""
        structure = self.continuous
        return [structure.coefficients(i) for i in range(structure.inputs)] if structure else []

    @property
    def idle(self) -> list[int]:
        """Inputs, counted from 1, whose coefficients together are within their uncertainty of 0."""
        return [i for i, b in enumerate(self.numerators, start=1) if _may_be_zero(self.at, b)]


def judged(outcome: Outcome) -> tuple[FitStatus, str, bool]:
    """Return whether to trust a fit, why, and whether its structure is refuted.

    The first rule that objects decides.
    """
    for status, rule in RULES:
        objection = rule(outcome)
        if objection:
            return status, objection, rule in REFUTING
    sentence = "; ".join(["converged inside the bounds", *_notes(outcome)])
    return FitStatus.CONVERGED, sentence, False


def _unsettled(of: Outcome) -> str:
    return "" if of.run.settled else "the solver ran out of evaluations before it converged"


def _unstable(of: Outcome) -> str:
    if of.continuous or all(abs(z) < 1.0 for z in of.structure.poles(of.x)):
        return ""
    return "a pole lies on or outside the unit circle: the free run does not settle"


def _too_fast(of: Outcome) -> str:
    if not (of.continuous and of.range):
        return ""
    shortest, constants = of.range[0], of.continuous.constants(of.x)
    # An oscillation is resolved up to half the sampling rate.
    resolved = np.where(np.imag(constants) == 0.0, shortest, shortest / np.pi)
    if not np.any(of.sizes < resolved):
        return ""
    return (
        f"time constant {np.min(of.sizes):.3g} s is shorter than one sample ({shortest:.3g} s): "
        "the records do not resolve it, lower the order"
    )


def _too_slow(of: Outcome) -> str:
    if not of.range or np.all(np.log(100.0 * of.range[1]) - np.log(of.sizes) >= _AT_BOUND):
        return ""
    return (
        f"time constant {np.max(of.sizes):.3g} s is at its upper bound, a hundred records long: "
        "the output does not settle, or integrates"
    )


def _undamped(of: Outcome) -> str:
    """An oscillation that lasts longer than the records, which do not show its damping.

    With a command that repeats itself such poles lie at its harmonics, where they imitate what is
    not linear. Of a pair slower than the records no period is seen: it stands for a drift.
    """
    if not (of.continuous and of.range):
        return ""
    duration = of.range[1]
    for pair in range(of.continuous.pairs):
        wn, zeta = np.exp(of.x[2 * pair : 2 * pair + 2])
        half = of.at.half_width(of.at.unit(2 * pair + 1))
        at_bound = np.log(zeta / LEAST_DAMPING) < _AT_BOUND
        vague = at_bound or half is None or half > np.log(VAGUE)
        if vague and wn * duration > 2.0 * np.pi and zeta * wn * duration < 1.0:
            return (
                f"zeta = {zeta:.3g}: the oscillation at {wn:.3g} rad/s lasts longer than the"
                " records, which do not show its damping; lower the order"
            )
    return ""


def _repeated(of: Outcome) -> str:
    """A dead time after which the inputs are what they were, or their mirror image."""
    structure = of.continuous
    if not structure or isinstance(of.data, FrequencyRecord):
        return ""
    for i, delay in enumerate(structure.delays(of.x)):
        if delay > 0.0 and all(inputs_repeat(record, i, float(delay)) for record in of.data):
            name = f"L[{i + 1}]" if structure.inputs > 1 else "L"
            return (
                f"{name} = {delay:.3g} s: after this time the inputs repeat themselves, or their"
                " mirror image, so that the records do not determine it; leave it out, or give a"
                " command that does not repeat"
            )
    return ""


def _singular(of: Outcome) -> str:
    if of.at.covariance is not None:
        return ""
    if of.structure.kind == "arx":
        return (
            f"the records do not determine {of.structure.sentence}: directions are not excited;"
            " give an input that changes more often, or lower the order"
        )
    return "the Jacobian is singular: parameters are not identifiable"


def _outside(of: Outcome) -> str:
    if not isinstance(of.data, FrequencyRecord):
        return ""
    w = of.data.frequency
    outside = [p for p in 1.0 / of.sizes if not w[0] / BEYOND < p < w[-1] * BEYOND]
    if not outside:
        return ""
    return (
        f"a pole at {min(outside):.3g} rad/s lies far outside the measured frequencies"
        f" ({w[0]:.3g} to {w[-1]:.3g} rad/s): lower the order, or measure there"
    )


def _no_delay(of: Outcome) -> str:
    late = of.continuous and of.continuous.dead_time and not of.range
    if not late or of.structure.delay(of.x) > 0.0:
        return ""
    return "no dead time is detected: leave it out"


def _cancelled_integrator(of: Outcome) -> str:
    if not (of.continuous and of.continuous.integrators and of.range):
        return ""
    if all(_contains_zero(of.at, places.start) for places in of.numerators):
        return (
            "the interval of the gain contains 0, so that a zero cancels an integrator: the records"
            " do not show that the output integrates"
        )
    zeros = [np.roots(of.x[places][::-1]) for places in of.numerators]
    if all(np.any(np.abs(one) * of.range[1] < 1.0) for one in zeros):
        return (
            "a zero slower than the longest record cancels an integrator: the records do not show "
            "that the output integrates so often"
        )
    return ""


def _no_gain(of: Outcome) -> str:
    if not of.continuous or len(of.idle) < of.continuous.inputs:
        return ""
    return (
        "the interval of the gain contains 0: the input explains nothing of the output, or "
        "the records are too short to show where it settles"
    )


def _merged(of: Outcome) -> str:
    pair = merged_lags(of.continuous, of.at) if of.continuous else None
    if pair is None:
        return ""
    return (
        f"time constants {pair[0]:.3g} s and {pair[1]:.3g} s merge within "
        "their uncertainty: the records show a double lag or an oscillation; allow "
        "complex poles or lower the order"
    )


def _vague(of: Outcome) -> str:
    vague = vague_parameter(of.continuous, of.at) if of.continuous else None
    if vague is None:
        return ""
    name, value, unit = vague
    shown = f"{name} = {value:.3g}" + ("" if unit == "-" else f" {unit}")
    return (
        f"{shown} is known to no better than a factor of {VAGUE:g}: more poles or "
        "zeros than the records show, lower the order"
    )


RULES: tuple[tuple[FitStatus, Callable[[Outcome], str]], ...] = (
    (FitStatus.NOT_CONVERGED, _unsettled),
    (FitStatus.DEGENERATE, _unstable),
    (FitStatus.DEGENERATE, _too_fast),
    (FitStatus.AT_BOUND, _too_slow),
    (FitStatus.DEGENERATE, _undamped),
    (FitStatus.DEGENERATE, _repeated),
    (FitStatus.DEGENERATE, _singular),
    (FitStatus.DEGENERATE, _outside),
    (FitStatus.DEGENERATE, _no_delay),
    (FitStatus.DEGENERATE, _cancelled_integrator),
    (FitStatus.DEGENERATE, _no_gain),
    (FitStatus.DEGENERATE, _merged),
    (FitStatus.DEGENERATE, _vague),
)
"""Each with the status that it gives where it objects; the objection is a sentence."""

REFUTING = (_undamped, _repeated)
"""Rules by which a structure describes the records by what they do not show: however well it fits,
another is to be chosen."""


def _notes(of: Outcome) -> Iterator[str]:
    """What a reader should know of a fit that can be trusted."""
    for i in of.idle:
        yield f"input {i} explains nothing of the output, its gain may be 0"
    for i, latest in of.latest.items():
        which = f" of input {i + 1}" if len(of.numerators) > 1 else ""
        yield f"no dead time{which} is detected, it is below {latest:.3g} s"
    if of.run.disagreement is not None and not of.run.weighted:
        yield (
            "weighting by the noise model moves the estimates too far, so the "
            "structure is wrong somewhere: the estimates that simulate best are kept"
        )
    if of.lost > _LOST:
        yield (
            f"the free run fits {of.lost:.0f} points worse than the one-step prediction: the noise"
            " is not that of ARX and biases the poles, prefer output error"
        )
    if None in of.structure.continuous_poles(of.x):
        yield "a pole <= 0 has no continuous equivalent (often noise, or too high an order)"
    if of.white and of.lag1 > _CORRELATED:
        yield (f"residuals are correlated (lag 1: {of.lag1:.2f}), the intervals are too narrow")


def _contains_zero(at: Optimum, i: int) -> bool:
    """Whether the interval of a coordinate contains 0."""
    half = at.half_width(at.unit(i))
    return half is not None and abs(float(at.coordinates[i])) < half


def _may_be_zero(at: Optimum, places: slice) -> bool:
    """Whether all coefficients together are within their uncertainty of 0 (Wald's test)."""
    if at.covariance is None:
        return False
    b, covariance = at.coordinates[places], at.covariance[places, places]
    if np.any(b[np.diag(covariance) == 0.0] != 0.0):  # held
        return False
    solved: Any = np.linalg.lstsq(covariance, b, rcond=None)[0]
    # The square of the quantile is that of one coefficient; of several the sum must be larger.
    return float(b @ solved) < at.quantile**2 * b.size
