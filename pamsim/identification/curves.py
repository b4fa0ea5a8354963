"""What the figures of an identification draw: signals, residuals, responses with their bands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pamsim.identification.models import Candidate
from pamsim.identification.signals import Signal, SignalTable
from pamsim.linear.response_bands import frequency_response, step_response_band
from pamsim.linear.signal_record import SignalRecord

FloatArray = NDArray[np.float64]

_POINTS = 300
_STEP_LENGTH = 6.0  # slowest time constants that a step response is drawn for
_BELOW, _ABOVE = 0.03, 30.0  # corner frequencies, between which a Bode plot is drawn


@dataclass(frozen=True, kw_only=True)
class TrialCurve:
    """One trial with the free run of the shown model, each (n,), in shown units.

    Attributes:
        name: of the trial.
        held_out: whether it was kept from the fit.
        time: [s].
        input: [shown unit of the input].
        output: [shown unit of the output].
        model: [shown unit of the output].
    """

    name: str
    held_out: bool
    time: FloatArray
    input: FloatArray
    output: FloatArray
    model: FloatArray


@dataclass(frozen=True, kw_only=True)
class Curves:
    """Everything the figures draw, in shown units.

    Attributes:
        trials: fitted ones first.
        step_time: (k,) [s].
        step: response to a unit step of the input, (k,) [gain].
        step_band: 95 %, (2, k) [gain], or None.
        frequency: (k,) [rad/s].
        magnitude: (k,) [gain].
        magnitude_band: 95 %, (2, k) [gain], or None.
        phase: (k,) [deg].
        phase_band: 95 %, (2, k) [deg], or None.
        nyquist: half the sampling rate [rad/s].
    """

    trials: tuple[TrialCurve, ...]
    step_time: FloatArray
    step: FloatArray
    step_band: FloatArray | None
    frequency: FloatArray
    magnitude: FloatArray
    magnitude_band: FloatArray | None
    phase: FloatArray
    phase_band: FloatArray | None
    nyquist: float


def curves_of(
    candidate: Candidate,
    used: Sequence[tuple[SignalTable, SignalRecord]],
    held_out: Sequence[tuple[SignalTable, SignalRecord]],
    given: Signal,
    output: Signal,
) -> Curves:
    """Run the shown model on every trial, and take its step and frequency response.

    Args:
        candidate: a continuous model.
        used: trials it was fitted to.
        held_out: trials it was not fitted to.
        given: the input.
        output: the output.
    """
    fit = candidate.fit
    rates = np.abs(np.array(fit.poles))
    nyquist = float(np.pi / min(record.sample_time for _, record in used))
    horizon = _STEP_LENGTH / float(np.min(rates)) + fit.dead_time
    step = step_response_band(fit, np.linspace(0.0, horizon, _POINTS))
    high = max(min(_ABOVE * float(np.max(rates)), nyquist), 10.0 * float(np.min(rates)))
    bode = frequency_response(fit, np.geomspace(_BELOW * float(np.min(rates)), high, _POINTS))
    gain, degrees = given.factor / output.factor, 180.0 / np.pi
    return Curves(
        trials=tuple(
            TrialCurve(
                name=record.name,
                held_out=kept,
                time=record.time,
                input=record.input / given.factor,
                output=record.output / output.factor,
                model=fit.simulate(record) / output.factor,
            )
            for kept, pairs in ((False, used), (True, held_out))
            for _, record in pairs
        ),
        step_time=step.time,
        step=step.output * gain,
        step_band=None if step.band is None else step.band * gain,
        frequency=bode.frequency,
        magnitude=bode.magnitude * gain,
        magnitude_band=None if bode.magnitude_band is None else bode.magnitude_band * gain,
        phase=bode.phase * degrees,
        phase_band=None if bode.phase_band is None else bode.phase_band * degrees,
        nyquist=nyquist,
    )
