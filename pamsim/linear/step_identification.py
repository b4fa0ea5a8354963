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
from pamsim.inference.record_checks import increasing_time, uniform_interval, varying_output
from pamsim.linear.arx import (
    ArxModel,
    UnderdeterminedError,
    fit_arx,
    lag,
    simulate_arx,
    time_constants_from_arx,
)
from pamsim.linear.first_second_order import unit_step
from pamsim.linear.fit_percent import fit_percent
from pamsim.linear.identified_model import IdentifiedModel
from pamsim.linear.step_fit import final_value, fit_step

OUTPUT_ERROR = "output error, unit gain"
ARX_UNIT = "ARX least squares, unit gain"
ARX_FREE = "ARX least squares, free gain"
NOT_IDENTIFIABLE = "not_identifiable"

# Change of the response over its last tenth, against its final value, above which dividing by the
# final value shortens the time constants noticeably: at 0.5 % (a 3 s record of the printed G2) T
# of G1 is 1.7 % too short. Much tighter and sensor noise would trip it.
SETTLED_CHANGE = 0.005


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
    model: ArxModel | None
    gain: float | None
    time_constants: tuple[float, ...]
    fit_percent: float | None
    fit_percent_continuous: float | None

    def to_dict(self) -> dict[str, Any]:
        """Return what JSON can hold; order 1 writes ``T_s``, order 2 ``T1_s`` and ``T2_s``."""
        return {
            "method": self.method,
            "status": self.status,
            "sentence": self.sentence,
            "K": self.gain,
            **_named(self.order, self.time_constants),
            "fit_percent": self.fit_percent,
            "fit_percent_continuous": self.fit_percent_continuous,
            "a": self.model.a if self.model else None,
            "b": self.model.b if self.model else None,
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
    final = final_value(raw - raw[0])
    y = (raw - raw[0]) / final
    t: FloatArray = np.linspace(0.0, interval * (y.size - 1), y.size, dtype=np.float64)
    return StepIdentification(
        g1=_estimates(t, y, interval, 1),
        g2=_estimates(t, y, interval, 2),
        final_value=final,
        static_gain=final / step_size,
        sample_time=interval,
        duration=float(t[-1]),
        change_last_tenth=_change_last_tenth(y),
        settled=abs(_change_last_tenth(y)) <= SETTLED_CHANGE,
    )


def _change_last_tenth(y: FloatArray) -> float:
    count = max(1, y.size // 50)
    end = y.size - y.size // 10
    return float(np.mean(y[-count:]) - np.mean(y[end - count : end]))


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
    # One sample of rest makes G2's b1 and b2 identifiable: afterwards u never changes.
    rest = np.zeros(lag(order, order, 1) - 1)
    unit = np.ones(t.size)
    try:
        model = fit_arx(
            np.concatenate([rest, y]),
            np.concatenate([rest, unit]),
            interval,
            na=order,
            nb=order,
            static_gain=gain,
        )
    except UnderdeterminedError as error:
        return ArxStep(
            method=method,
            order=order,
            status=NOT_IDENTIFIABLE,
            sentence=str(error),
            model=None,
            gain=None,
            time_constants=(),
            fit_percent=None,
            fit_percent_continuous=None,
        )
    chain = time_constants_from_arx(model)
    smooth: float | None = None
    if chain.gain is not None:
        smooth = fit_percent(y, chain.gain * unit_step(t, chain.time_constants))
    return ArxStep(
        method=method,
        order=order,
        status=chain.status.value,
        sentence=chain.sentence,
        model=model,
        gain=chain.gain,
        time_constants=chain.time_constants,
        fit_percent=fit_percent(y, simulate_arx(model, unit)),
        fit_percent_continuous=smooth,
    )


def _named(order: int, values: tuple[Any, ...]) -> dict[str, Any]:
    """Name values by time constant; None where there are none."""
    names = ("T_s",) if order == 1 else ("T1_s", "T2_s")
    return dict(zip(names, values or (None,) * order, strict=True))
