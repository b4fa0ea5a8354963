"""G1 and G2 from one sampled step response, by every estimator side by side.

T depends on the estimator: on the same noise-free response, G1 by output error, by ARX with unit
gain and by free ARX differ by more than 10 %. So every estimate names its estimator.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pamsim.core.encoding import json_key
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.identification.arx import (
    ArxModel,
    UnderdeterminedError,
    fit_arx,
    time_constants_from_arx,
)
from pamsim.identification.continuous_fit import continuous_estimates, merged_lags
from pamsim.identification.continuous_structure import ContinuousStructure
from pamsim.identification.first_second_order import unit_step
from pamsim.identification.fit_percent import fit_percent
from pamsim.identification.identified_model import (
    NOT_SETTLED,
    SINGULAR,
    FitStatus,
    IdentifiedModel,
    trial_score,
)
from pamsim.identification.optimum import Optimum, student_quantile
from pamsim.identification.separable_fit import inverse_information
from pamsim.inference.bounded_least_squares import Fit, bounded_least_squares, one_by_one
from pamsim.inference.coloured_noise import ArNoise
from pamsim.inference.record_checks import increasing_time, uniform_interval, varying_output
from pamsim.inference.trial_noise import TrialNoise

OUTPUT_ERROR = "output error, unit gain"
ARX_UNIT = "ARX least squares, unit gain"
ARX_FREE = "ARX least squares, free gain"
NOT_IDENTIFIABLE = "not_identifiable"

# Change of the response over its last tenth, against its final value, above which dividing by the
# final value shortens the time constants noticeably: at 0.5 % (a 3 s record of the printed G2) T
# of G1 is 1.7 % too short. Much tighter and sensor noise would trip it.
SETTLED_CHANGE = 0.005

# Splits of the 63 % time into (T1, T2): G2 has a mirror-symmetric cost with a saddle at T1 = T2,
# so starts lie on one side of it, from well separated to nearly merged.
_STARTS: dict[int, tuple[tuple[float, ...], ...]] = {
    1: ((0.5,), (1.0,), (2.0,)),
    2: ((0.02, 1.0), (0.15, 0.85), (0.4, 0.6)),
}
_SINGULAR = 1e-6  # smallest over largest singular value of the column-scaled Jacobian
_ROUNDING = 1e-20  # variance of a residual that is rounding alone, of a response of size 1


@dataclass(frozen=True)
class ArxStep:
    """One ARX estimate from a normalised step response.

    Attributes:
        method: the estimator in words.
        order: 1 or 2.
        status: ``lags``, ``complex_poles``, ``non_positive_pole``, ``unstable_pole`` or
            ``not_identifiable``.
        sentence: the same for a person.
        model: the discrete model; None if not identifiable.
        gain: K against the response's own final value; None unless ``lags`` [-].
        time_constants: rising; empty unless ``lags`` [s].
        fit_percent: fit of the discrete model's own simulated step; None if not identifiable [%].
        fit_percent_continuous: fit of G1 or G2 with these K and T; None unless ``lags`` [%].
    """

    method: str
    order: int
    status: str
    sentence: str
    model: ArxModel | None = None
    gain: float | None = None
    time_constants: tuple[float, ...] = ()
    fit_percent: float | None = None
    fit_percent_continuous: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """Return what JSON can hold; order 1 writes ``T_s``, order 2 ``T1_s`` and ``T2_s``."""
        found = self.model
        a, b = (None, None) if found is None else np.split(found.coordinates, [self.order])
        return {
            "method": self.method,
            "status": self.status,
            "sentence": self.sentence,
            "K": self.gain,
            **_named(self.order, self.time_constants),
            "fit_percent": self.fit_percent,
            "fit_percent_continuous": self.fit_percent_continuous,
            "a": a,
            "b": b,
        }


@dataclass(frozen=True)
class ModelEstimates:
    """All estimates of one model order: output error first, ARX beside it."""

    output_error: IdentifiedModel
    arx_unit_gain: ArxStep
    arx_free_gain: ArxStep

    def to_dict(self) -> dict[str, Any]:
        """Return what JSON can hold; keys carry their unit (``T_s``; ``T1_s``, ``T2_s``)."""
        fit = self.output_error
        (score,) = fit.trials
        order = self.arx_unit_gain.order
        intervals = _named(order, fit.interval95_time_constants)
        return {
            "method": OUTPUT_ERROR,
            "status": fit.status,
            "sentence": fit.sentence,
            "K": fit.gain,
            **_named(order, fit.time_constants),
            **{f"interval95_{name}": value for name, value in intervals.items()},
            "fit_percent": fit.fit_percent,
            "rms": score.rms,
            "residual_lag1": score.residual_lag1,
            "evaluations": fit.evaluations,
            "arx": {"unit_gain": self.arx_unit_gain, "free_gain": self.arx_free_gain},
        }


@dataclass(frozen=True)
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
    step, input and output are taken to rest at 0.

    Args:
        time: uniform sample times, shape ``(n,)``, n >= 8 [s].
        response: output, shape ``(n,)`` [output unit].
        step_size: height of the input step, not 0 [input unit].

    Returns:
        G1 and G2 by output error with unit gain and by ARX least squares with unit and free gain.

    Raises:
        InputError: short, constant, non-finite or non-uniform record, no step in the input, or a
            response that ends where it began.

    Source: Matiskova 2021, equations (24)-(31).
    """
    if not (math.isfinite(step_size) and step_size != 0.0):
        raise InputError(f"step size {step_size!r}: there is no step in the input; give its height")
    stamps, raw = increasing_time(time, response, minimum=8)
    interval = uniform_interval(stamps)
    varying_output(raw)
    final = _final_value(raw - raw[0])
    y = (raw - raw[0]) / final
    t: FloatArray = np.linspace(0.0, interval * (y.size - 1), y.size, dtype=np.float64)
    count, end = max(1, y.size // 50), y.size - y.size // 10
    change = float(np.mean(y[-count:]) - np.mean(y[end - count : end]))
    return StepIdentification(
        g1=_estimates(t, y, interval, 1),
        g2=_estimates(t, y, interval, 2),
        final_value=final,
        static_gain=final / step_size,
        sample_time=interval,
        duration=float(t[-1]),
        change_last_tenth=change,
        settled=abs(change) <= SETTLED_CHANGE,
    )


def _estimates(t: FloatArray, y: FloatArray, interval: float, order: int) -> ModelEstimates:
    return ModelEstimates(
        output_error=fit_step(t, y, order=order),
        arx_unit_gain=_arx(t, y, interval, order, ARX_UNIT, 1.0),
        arx_free_gain=_arx(t, y, interval, order, ARX_FREE, None),
    )


def _arx(
    t: FloatArray, y: FloatArray, interval: float, order: int, method: str, gain: float | None
) -> ArxStep:
    """Fit ARX(order, order) after the step, with the rest before it as history."""
    # Samples of rest make G2's b1 and b2 identifiable: afterwards u never changes.
    rest = np.zeros(order - 1)
    unit = np.ones(t.size)
    given, output = np.append(rest, unit), np.append(rest, y)
    try:
        model = fit_arx(output, given, interval, na=order, nb=order, static_gain=gain)
    except UnderdeterminedError as error:
        return ArxStep(method, order, NOT_IDENTIFIABLE, str(error))
    chain = time_constants_from_arx(model)
    smooth: float | None = None
    if chain.gain is not None:
        smooth = fit_percent(y, chain.gain * unit_step(t, chain.time_constants))
    return ArxStep(
        method=method,
        order=order,
        **vars(chain),
        model=model,
        fit_percent=fit_percent(y, model.structure.forced(model.coordinates, unit)),
        fit_percent_continuous=smooth,
    )


def _named(order: int, values: tuple[Any, ...]) -> dict[str, Any]:
    """Name values by time constant; None where there are none."""
    names = ("T_s",) if order == 1 else ("T1_s", "T2_s")
    return dict(zip(names, values or (None,) * order, strict=True))


def fit_step(time: ArrayLike, response: ArrayLike, *, order: int) -> IdentifiedModel:
    """Fit G1 or G2 of gain 1 to a normalised step response, least squares of the simulated output.

    The step happens at ``time[0]``, from rest at 0. Time constants are sought as logarithms between
    a tenth of a sample and a hundred record lengths, from several fixed starts. A response with a
    gain, a dead time or an offset is a record for `fit_continuous`.

    The 95 % intervals come from the Jacobian at the optimum and Student's t. They assume white
    residuals and the right model order. Residuals of a wrong order or of a sampled mechanism are
    strongly correlated (see ``residual_lag1`` of the trial), and then the intervals are far too
    narrow. They are None where the data do not determine the parameter. Times need not be uniform.

    Source: model of Matiskova 2021 (Appl. Sci. 2021, 11, 7288), equation (24); the paper itself
    names only ARX least squares, (25)-(29).
    """
    if order not in _STARTS:
        raise InputError(f"order = {order!r} is not known; give 1 for G1 or 2 for G2")
    t, y = increasing_time(time, response, minimum=8)
    varying_output(y)
    t = t - t[0]
    reached = np.flatnonzero(np.abs(y) >= 0.632 * abs(_final_value(y)))
    reference = max(float(t[reached[0]]), float(t[1]))
    interval = float(np.median(np.diff(t)))
    low, high = np.log(interval / 10.0), np.log(100.0 * float(t[-1]))
    found = bounded_least_squares(
        one_by_one(lambda x: unit_step(t, tuple(np.exp(x).tolist())) - y),
        [np.log(np.array(split) * reference) for split in _STARTS[order]],
        lower=np.full(order, low),
        upper=np.full(order, high),
        jacobian="3-point",
        x_scale=1.0,
        tolerance=1e-12,
        gradient_tolerance=1e-12,
        max_steps=200,
    )
    variance = found.cost / (t.size - order)
    inverse = inverse_information(found.jacobian, _SINGULAR)
    covariance = None if inverse is None else np.pad(variance * inverse, (0, 1))  # the gain is held
    structure = ContinuousStructure(order)
    quantile = student_quantile(t.size - order)
    at = Optimum(np.append(found.x, 1.0), covariance, quantile)
    status, sentence = _status(structure, at, found, (low, high), interval)
    if status not in (FitStatus.CONVERGED, FitStatus.DEGENERATE):
        at = replace(at, covariance=None)
    score = trial_score("step", y, y + found.residual)
    # Of a perfect match only rounding remains, whose correlation means nothing.
    if status is FitStatus.CONVERGED and score.residual_lag1 > 0.5 and variance > _ROUNDING:
        sentence += (
            f"; residuals are correlated (lag 1: {score.residual_lag1:.2f}), the intervals are too"
            " narrow"
        )
    gain, *lags = continuous_estimates(structure, at, "-", ("-",), {})
    return IdentifiedModel(
        **vars(at),
        structure=structure,
        estimates=(replace(gain, interval95=None), *lags),
        trials=(score,),
        fit_percent=score.fit_percent,
        noise=TrialNoise((ArNoise((), variance),)),
        status=status,
        sentence=sentence,
        evaluations=found.evaluations,
    )


def _status(
    structure: ContinuousStructure,
    at: Optimum,
    found: Fit,
    bounds: tuple[float, float],
    interval: float,
) -> tuple[FitStatus, str]:
    shortest, longest = np.min(found.x), np.max(found.x)
    if not found.converged:
        return NOT_SETTLED
    # The cost is flat towards a vanishing lag, so the solver may stop short of the bound itself.
    if shortest < bounds[0] + np.log(2.0) or longest > bounds[1] - np.log(2.0):
        return FitStatus.AT_BOUND, (
            "a parameter is at its bound: the record shows no such lag, or is too short for it"
        )
    if np.exp(shortest) < interval:
        return FitStatus.DEGENERATE, (
            f"time constant {np.exp(shortest):.3g} s is shorter than one sample ({interval:.3g} s):"
            " the record does not resolve it"
        )
    if at.covariance is None:
        return SINGULAR
    if merged_lags(structure, at) is not None:
        return FitStatus.DEGENERATE, (
            "T1 and T2 merge within their uncertainty: the record shows a double lag or an "
            "oscillation, and does not determine two separate real lags"
        )
    return FitStatus.CONVERGED, "converged inside the bounds"


def _final_value(response: FloatArray) -> float:
    """Return the mean of the last 2 % of the samples (at least one) [output unit]."""
    count = max(1, response.size // 50)
    final = float(np.mean(response[-count:]))
    if abs(final) < 1e-3 * float(np.max(np.abs(response))):
        raise InputError(
            f"response ends where it began (final value {final:g}, mean of the last {count} "
            "samples): G1 and G2 describe a lasting step; cut the record before the return"
        )
    return final
