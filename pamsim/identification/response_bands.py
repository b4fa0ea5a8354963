"""Frequency and step responses of fitted models with their 95 % bands, by the delta method."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.identification.discrete import DiscreteStructure
from pamsim.identification.model import IdentifiedModel
from pamsim.inference.record_checks import finite_samples, uniform_interval


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """Bode data with pointwise 95 % bands; the bands are None where the fit has no covariance.

    Attributes:
        frequency: shape ``(n,)`` [rad/s].
        magnitude: ``|G|``, shape ``(n,)`` [output unit per input unit].
        phase: unwrapped, dead time included, shape ``(n,)`` [rad].
        magnitude_band: lower and upper, shape ``(2, n)``; symmetric in the logarithm.
        phase_band: lower and upper, shape ``(2, n)`` [rad].
    """

    frequency: FloatArray
    magnitude: FloatArray
    phase: FloatArray
    magnitude_band: FloatArray | None
    phase_band: FloatArray | None

    def scaled(self, gain: float) -> FrequencyResponse:
        """Return it for other units of input and output; ``gain`` converts the magnitude."""
        band = None if self.magnitude_band is None else gain * self.magnitude_band
        return replace(self, magnitude=gain * self.magnitude, magnitude_band=band)


@dataclass(frozen=True, eq=False)
class StepResponse:
    """Unit-step response with its pointwise 95 % band.

    Attributes:
        time: since the step, shape ``(n,)`` [s].
        output: shape ``(n,)`` [output unit].
        band: lower and upper, shape ``(2, n)`` [output unit]; None without covariance.
    """

    time: FloatArray
    output: FloatArray
    band: FloatArray | None

    def scaled(self, gain: float) -> StepResponse:
        """Return it for other units of input and output; ``gain`` converts the output."""
        band = None if self.band is None else gain * self.band
        return replace(self, output=gain * self.output, band=band)


def frequency_response(fit: IdentifiedModel, frequencies: ArrayLike) -> FrequencyResponse:
    """Return magnitude and phase of a fitted model with their 95 % bands, at frequencies [rad/s].

    The phase of a dead time is exact, not a Pade approximation.
    """
    w = finite_samples(frequencies, "frequencies")
    if w.size == 0 or w[0] <= 0.0 or np.any(np.diff(w) <= 0.0):
        raise InputError("frequencies must be positive and rise; sort them and drop 0 and repeats")
    if isinstance(fit.structure, DiscreteStructure):
        nyquist = np.pi / fit.structure.sample_time
        if w[-1] > nyquist * (1.0 + 1e-9):
            raise InputError(
                f"frequency {w[-1]:g} rad/s is beyond {nyquist:g} rad/s, half the sampling rate "
                "of the discrete model; leave it out"
            )

    structure = fit.structure
    value = structure.frequency_response(fit.coordinates, w)
    magnitude, phase = np.abs(value), np.unwrap(np.angle(value))
    # Log and phase are real and imaginary part of ln G, whose derivative is dG / G.
    half = fit.half_widths(lambda x: structure.frequency_response(x, w) / value)
    if half is None:
        return FrequencyResponse(w, magnitude, phase, None, None)
    with np.errstate(over="ignore"):
        factor = np.exp(np.real(half))
    return FrequencyResponse(
        w,
        magnitude,
        phase,
        np.stack([magnitude / factor, magnitude * factor]),
        np.stack([phase - np.imag(half), phase + np.imag(half)]),
    )


def step_response_band(fit: IdentifiedModel, time: ArrayLike) -> StepResponse:
    """Return the unit-step response of a fitted model from rest with its 95 % band.

    Times are uniform, from 0; of a discrete model its own samples [s].
    """
    t, interval = time_from_0(time)
    if isinstance(fit.structure, DiscreteStructure):
        own = fit.structure.sample_time
        if abs(interval - own) > 1e-3 * own:
            raise InputError(
                f"time has interval {interval:g} s but the model is sampled at {own:g} s; use its "
                "own sample times"
            )

    structure = fit.structure
    output = structure.step_response(fit.coordinates, t.size, interval)
    half = fit.half_widths(lambda x: structure.step_response(x, t.size, interval))
    band = None if half is None else np.stack([output - half, output + half])
    return StepResponse(t, output, band)


def time_from_0(time: ArrayLike) -> tuple[FloatArray, float]:
    """Return uniform times and their interval [s]."""
    t = finite_samples(time, "time")
    if t.size < 2 or t[0] != 0.0 or np.any(np.diff(t) <= 0.0):
        raise InputError("time must start at 0 and increase over at least 2 samples; shift it")
    return t, uniform_interval(t)
