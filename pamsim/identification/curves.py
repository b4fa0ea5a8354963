"""What the figures of an identification draw: signals, residuals, responses with their bands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.identification.model import IdentifiedModel
from pamsim.identification.records import SignalRecord
from pamsim.identification.response_bands import (
    FrequencyResponse,
    StepResponse,
    frequency_response,
    step_response_band,
)
from pamsim.identification.signals import Signal, UsedTrial

_POINTS = 300  # of a curve: as many as a figure shows
_STEP_LENGTH = 6.0  # slowest time constants that a step response is drawn for
_BELOW, _ABOVE = 0.03, 30.0  # corner frequencies, between which a Bode plot is drawn


@dataclass(frozen=True, kw_only=True)
class TrialCurve:
    """One trial with the free run of the shown model, each (n,), in the columns' units.

    Attributes:
        name: of the trial.
        held_out: whether it was excluded from the fit.
        time: [s].
        inputs: shape ``(n, k)`` [unit of each input].
        output: [unit of the output].
        model: [unit of the output].
    """

    name: str
    held_out: bool
    time: FloatArray
    inputs: FloatArray
    output: FloatArray
    model: FloatArray


@dataclass(frozen=True, kw_only=True)
class Curves:
    """Everything the figures draw, gains in the columns' units.

    Attributes:
        trials: fitted ones first.
        steps: response to a unit step of each input.
        bodes: frequency response to each input.
        nyquist: half the sampling rate [rad/s].
    """

    trials: tuple[TrialCurve, ...]
    steps: tuple[StepResponse, ...]
    bodes: tuple[FrequencyResponse, ...]
    nyquist: float


def trial_curve(
    record: SignalRecord,
    run: FloatArray,
    inputs: Sequence[Signal],
    out: Signal,
    held_out: bool,
) -> TrialCurve:
    """A record with a run of a model, both in SI, in the columns' units."""
    return TrialCurve(
        name=record.name,
        held_out=held_out,
        time=record.time,
        inputs=record.inputs / [into.factor for into in inputs],
        output=record.output / out.factor,
        model=run / out.factor,
    )


def curves_of(
    fit: IdentifiedModel,
    used: Sequence[UsedTrial],
    held_out: Sequence[UsedTrial],
    inputs: Sequence[Signal],
    out: Signal,
) -> Curves:
    """Run a continuous model on every trial, and take its step and frequency responses."""
    rates = np.abs(np.array([pole for pole in fit.poles if pole != 0.0]))
    if rates.size == 0:  # a gain, or integrators alone
        rates = np.array([1.0 / max(trial.record.duration for trial in used)])
    nyquist = float(np.pi / min(trial.record.sample_time for trial in used))
    channels = [
        (channel, into.factor / out.factor)
        for channel, into in zip(fit.channels, inputs, strict=True)
    ]
    latest = max(channel.dead_time for channel, _ in channels)
    horizon = _STEP_LENGTH / float(np.min(rates)) + latest
    times = np.linspace(0.0, horizon, _POINTS)
    high = max(min(_ABOVE * float(np.max(rates)), nyquist), 10.0 * float(np.min(rates)))
    frequencies = np.geomspace(_BELOW * float(np.min(rates)), high, _POINTS)
    return Curves(
        trials=tuple(
            trial_curve(one.record, fit.simulate(one.record), inputs, out, one in held_out)
            for one in (*used, *held_out)
        ),
        steps=tuple(step_response_band(channel, times).scaled(gain) for channel, gain in channels),
        bodes=tuple(
            frequency_response(channel, frequencies).scaled(gain) for channel, gain in channels
        ),
        nyquist=nyquist,
    )
