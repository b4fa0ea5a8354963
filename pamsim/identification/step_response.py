"""G1 and G2 from one sampled step response, by every estimator side by side.

T depends on the estimator: on the same noise-free response, G1 by output error, by ARX with unit
gain and by free ARX differ by more than 10 %. So every estimate names its estimator.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pamsim.core.encoding import json_key
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.identification.continuous import ContinuousStructure
from pamsim.identification.discrete import DiscreteStructure, Structure
from pamsim.identification.fit import fit
from pamsim.identification.model import IdentifiedModel
from pamsim.identification.records import FEWEST_SAMPLES, SignalRecord, fit_percent
from pamsim.inference.record_checks import increasing_time, uniform_interval, varying_output

# Change of the response over its last tenth, against its final value, above which dividing by the
# final value shortens the time constants noticeably: at 0.5 % (a 3 s record of the printed G2) T
# of G1 is 1.7 % too short. Much tighter and sensor noise would trip it.
SETTLED_CHANGE = 0.005
_REST = 2
"""Samples at rest before the step: they make b1 and b2 of a second order identifiable, since
afterwards the input never changes."""


@dataclass(frozen=True, eq=False)
class StepEstimate:
    """G1 or G2 by one estimator."""

    method: str  # the estimator in words
    model: IdentifiedModel  # as it was fitted
    # of output error that of the fit; of ARX ``lags``, ``complex_poles``, ``non_positive_pole``,
    # ``unstable_pole`` or ``not_identifiable``
    status: str
    sentence: str  # the same for a person
    gain: float | None  # K against the response's own final value; None of ARX unless ``lags`` [-]
    fit_percent: float | None  # fit of the model's own simulated step; None if not identifiable [%]

    @property
    def time_constants(self) -> tuple[float, ...]:
        """Rising time constants; empty where there are none [s]."""
        return () if self.gain is None else self.model.time_constants

    def to_dict(self) -> dict[str, Any]:
        """Return what JSON can hold; keys carry their unit: ``T_s``, or ``T1_s`` and ``T2_s``."""
        names = ("T_s",) if len(self.model.poles) == 1 else ("T1_s", "T2_s")
        result = {
            "method": self.method,
            "status": self.status,
            "sentence": self.sentence,
            "K": self.gain,
            **dict.fromkeys(names),
            **dict(zip(names, self.time_constants, strict=False)),
            "fit_percent": self.fit_percent,
        }
        if isinstance(self.model.structure, ContinuousStructure):
            sides = zip(names, self.model.interval95_time_constants, strict=True)
            result |= {f"interval95_{name}": side for name, side in sides}
        return result


@dataclass(frozen=True, eq=False)
class ModelEstimates:
    """All estimates of one model order: output error first, ARX beside it."""

    output_error: StepEstimate
    arx_unit_gain: StepEstimate
    arx_free_gain: StepEstimate

    def to_dict(self) -> dict[str, Any]:
        """Return what JSON can hold."""
        arx = {"unit_gain": self.arx_unit_gain, "free_gain": self.arx_free_gain}
        return {**self.output_error.to_dict(), "arx": arx}


@dataclass(frozen=True, eq=False)
class StepIdentification:
    """G1 and G2 of one step response that was divided by its final value.

    Attributes:
        g1: estimates of ``K / (T s + 1)``.
        g2: estimates of ``K / ((T1 s + 1)(T2 s + 1))``.
        final_value: what the response was divided by [output unit].
        static_gain: final value over step size, the K that normalisation took out [out per in].
        sample_time: [s].
        duration: record length after the step [s].
        change_last_tenth: response at the end minus response at 90 % of the record, each a mean of
            2 % of the samples, over the final value [-].
        settled: whether that change is at most 0.5 %; if not, the final value is not yet the
            steady one and every unit-gain time constant is too short.
    """

    g1: ModelEstimates
    g2: ModelEstimates
    final_value: float
    static_gain: float
    sample_time: float = field(metadata=json_key("sample_time_s"))
    duration: float = field(metadata=json_key("duration_s"))
    change_last_tenth: float
    settled: bool


def identify_step(
    time: ArrayLike, response: ArrayLike, *, step_size: float = 1.0
) -> StepIdentification:
    """Identify G1 and G2 from one sampled step response.

    The first sample is the instant of the step; it is subtracted, and the rest is divided by the
    final value (mean of the last 2 % of the samples), so that the gain is 1 as the paper prints
    it. The record must therefore last until the response has settled, see ``settled``. Before the
    step, input and output are taken to rest at 0. Intervals take the residuals to be white.

    Args:
        time: uniform sample times, shape ``(n,)``, n >= 16 [s].
        response: output, shape ``(n,)`` [output unit].
        step_size: height of the input step, not 0 [input unit].

    Returns:
        G1 and G2 by output error with unit gain and by ARX least squares with unit and free gain.

    Raises:
        InputError: short, constant, non-finite or non-uniform record, no step in the input, or a
            response that ends where it began.

    Source: Matiskova 2021 (Appl. Sci. 2021, 11, 7288), equations (24)-(31); the paper itself names
    only ARX least squares, (25)-(29).
    """
    if not (math.isfinite(step_size) and step_size != 0.0):
        raise InputError(f"step size {step_size!r}: there is no step in the input; give its height")
    stamps, raw = increasing_time(time, response, FEWEST_SAMPLES)
    interval = uniform_interval(stamps)
    varying_output(raw)
    count, end = max(1, raw.size // 50), raw.size - raw.size // 10
    moved = raw - raw[0]
    final = float(np.mean(moved[-count:]))
    if abs(final) < 1e-3 * float(np.max(np.abs(moved))):
        raise InputError(
            f"response ends where it began (final value {final:g}, mean of the last {count} "
            "samples): G1 and G2 describe a lasting step; cut the record before the return"
        )
    y = moved / final
    record = SignalRecord(
        name="step",
        time=interval * np.arange(-_REST, y.size),
        inputs=np.append(np.zeros(_REST), np.ones(y.size)),
        output=np.append(np.zeros(_REST), y),
    )
    change = float(np.mean(y[-count:]) - np.mean(y[end - count : end]))
    return StepIdentification(
        g1=_estimates(record, 1),
        g2=_estimates(record, 2),
        final_value=final,
        static_gain=final / step_size,
        sample_time=interval,
        duration=interval * (y.size - 1),
        change_last_tenth=change,
        settled=abs(change) <= SETTLED_CHANGE,
    )


def step_of_lags(time: ArrayLike, *constants: float, gain: float = 1.0) -> FloatArray:
    """Return the step response of ``K / ((T1 s + 1) ... (Tn s + 1))`` from rest at 0.

    Args:
        time: uniform, from 0, shape ``(n,)`` [s].
        constants: T1 ... Tn, each above 0 [s].
        gain: K [output unit per input unit].

    Raises:
        InputError: for a time constant that is not above 0, or times that are not uniform.

    Source: Matiskova 2021 (Appl. Sci. 2021, 11, 7288), equation (24).
    """
    if not all(0.0 < constant < math.inf for constant in constants):
        raise InputError(f"time constants {constants} s: give finite ones above 0")
    interval = uniform_interval(np.asarray(time, np.float64))
    x = np.append(np.log(constants), gain)
    return ContinuousStructure(len(constants)).step_response(x, np.size(time), interval)


def _estimates(record: SignalRecord, order: int) -> ModelEstimates:
    arx = DiscreteStructure("arx", na=order, nb=order, nk=1, sample_time=record.sample_time)
    return ModelEstimates(
        _estimate(record, ContinuousStructure(order), "output error, unit gain", K=1.0),
        _estimate(record, arx, "ARX least squares, unit gain", K=1.0),
        _estimate(record, arx, "ARX least squares, free gain"),
    )


def _estimate(
    record: SignalRecord, structure: Structure, method: str, **held: float
) -> StepEstimate:
    model = fit([record], structure, held={**held, "offset": 0.0}, white=True)
    status, sentence, gain = str(model.status), model.sentence, 1.0
    if isinstance(structure, DiscreteStructure):
        status, sentence = _as_lags(model)
        gain = model.gain if status == "lags" else None
    fitted = None
    if status != "not_identifiable":
        run = model.simulate(record, offset=0.0)
        fitted = fit_percent(record.output[_REST:], run[_REST:])
    return StepEstimate(method, model, status, sentence, gain, fitted)


def _as_lags(model: IdentifiedModel) -> tuple[str, str]:
    """Whether discrete poles are those of a sampled chain of lags, and why not."""
    if model.covariance is None:
        return "not_identifiable", model.sentence
    poles = model.poles
    shown = ", ".join(f"{z.real:.6g}{z.imag:+.3g}j" if z.imag else f"{z.real:.6g}" for z in poles)
    if any(abs(z) >= 1.0 for z in poles):
        status = "unstable_pole"
        why = "a pole on or outside the unit circle does not settle: no time constant exists"
    elif any(z.imag != 0.0 for z in poles):
        status = "complex_poles"
        why = "the model oscillates: real T1, T2 do not exist"
    elif any(z.real <= 0.0 for z in poles):
        status = "non_positive_pole"
        why = "a pole <= 0 alternates from sample to sample: no lag does that (often noise)"
    else:
        lags = "one first-order lag" if len(poles) == 1 else f"{len(poles)} first-order lags"
        return "lags", f"pole{'s' * (len(poles) > 1)} {shown}: {lags}, sampled"
    return status, f"poles {shown}: {why}"
