"""What the figures of an identification draw: trials with the model's run, its responses.

Step and frequency responses have 95 % bands by the delta method.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pamsim.core.units import FloatArray
from pamsim.identification.model import IdentifiedModel
from pamsim.inference.record_checks import uniform_interval


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """Bode data with pointwise 95 % bands; the bands are None where the fit has no covariance."""

    frequency: FloatArray  # shape ``(n,)`` [rad/s]
    magnitude: FloatArray  # ``|G|``, shape ``(n,)`` [output unit per input unit]
    phase: FloatArray  # unwrapped, dead time included, shape ``(n,)`` [rad]
    # lower and upper, shape ``(2, n)``; symmetric in the logarithm
    magnitude_band: FloatArray | None
    phase_band: FloatArray | None  # lower and upper, shape ``(2, n)`` [rad]


@dataclass(frozen=True, eq=False)
class StepResponse:
    """Unit-step response with its pointwise 95 % band."""

    time: FloatArray  # since the step, shape ``(n,)`` [s]
    output: FloatArray  # shape ``(n,)`` [output unit]
    # lower and upper, shape ``(2, n)`` [output unit]; None without covariance
    band: FloatArray | None


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
    """Everything the figures draw, gains in the columns' units."""

    trials: tuple[TrialCurve, ...]  # fitted ones first
    steps: tuple[StepResponse, ...]  # response to a unit step of each input
    bodes: tuple[FrequencyResponse, ...]  # frequency response to each input
    nyquist: float  # half the sampling rate [rad/s]


def frequency_response(
    fit: IdentifiedModel, frequencies: ArrayLike, gain: float = 1.0
) -> FrequencyResponse:
    """Return magnitude and phase of a fitted model with their 95 % bands, at frequencies [rad/s].

    They rise from above 0, those of a discrete model to half its sampling rate. The phase of a dead
    time is exact, not a Pade approximation. ``gain`` multiplies the magnitude, for other units.
    """
    w, structure = np.asarray(frequencies, np.float64), fit.structure
    value = structure.frequency_response(fit.coordinates, w)
    magnitude, phase = gain * np.abs(value), np.unwrap(np.angle(value))
    # Log and phase are real and imaginary part of ln G, whose derivative is dG / G.
    half = fit.half_widths(lambda x: structure.frequency_response(x, w) / value)
    bands = None, None
    if half is not None:
        with np.errstate(over="ignore"):
            factor, turn = np.exp(np.real(half)), np.imag(half)
        bands = (
            np.stack([magnitude / factor, magnitude * factor]),
            np.stack([phase - turn, phase + turn]),
        )
    return FrequencyResponse(w, magnitude, phase, *bands)


def step_response_band(fit: IdentifiedModel, time: ArrayLike, gain: float = 1.0) -> StepResponse:
    """Return the unit-step response of a fitted model from rest with its 95 % band.

    Times are uniform, from 0; of a discrete model its own samples [s]. ``gain`` multiplies the
    output, for other units.
    """
    t, structure = np.asarray(time, np.float64), fit.structure
    interval = uniform_interval(t)
    output = gain * structure.step_response(fit.coordinates, t.size, interval)
    half = fit.half_widths(lambda x: gain * structure.step_response(x, t.size, interval))
    band = None if half is None else np.stack([output - half, output + half])
    return StepResponse(t, output, band)
