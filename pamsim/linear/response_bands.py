"""Frequency and step responses of fitted models with their 95 % bands, by the delta method."""

# scipy carries no types: what it returns is Any at this file's boundary.
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false
# pyright: reportUnknownVariableType=false

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.signal
from numpy.typing import ArrayLike, NDArray

from pamsim.core.errors import InputError
from pamsim.inference.record_checks import finite_samples, uniform_interval
from pamsim.linear.continuous_result import ContinuousFit
from pamsim.linear.discrete_result import DiscreteFit
from pamsim.linear.held_input import chain_derivatives

FloatArray = NDArray[np.float64]
_lfilter: Any = scipy.signal.lfilter

_NORMAL = 1.959964
_STEP = 6e-6  # the cube root of the rounding error, best for central differences


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

    def as_dict(self) -> dict[str, Any]:
        """Return JSON-safe values; keys carry their unit."""
        return {
            "frequency_rad_per_s": self.frequency.tolist(),
            "magnitude": self.magnitude.tolist(),
            "phase_deg": np.degrees(self.phase).tolist(),
            "interval95_magnitude": _listed(self.magnitude_band),
            "interval95_phase_deg": _listed(
                None if self.phase_band is None else np.degrees(self.phase_band)
            ),
        }


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

    def as_dict(self) -> dict[str, Any]:
        """Return JSON-safe values; keys carry their unit."""
        return {
            "time_s": self.time.tolist(),
            "output": self.output.tolist(),
            "interval95_output": _listed(self.band),
        }


def frequency_response(
    fit: ContinuousFit | DiscreteFit, frequencies: ArrayLike
) -> FrequencyResponse:
    """Return magnitude and phase of a fitted model with their 95 % bands.

    Args:
        fit: any fit to general inputs.
        frequencies: rising, > 0; of a discrete model up to ``pi / Ts``, shape ``(n,)`` [rad/s].

    Returns:
        Bode data. The phase of a dead time is exact, not a Pade approximation.

    Raises:
        InputError: frequencies are not rising and positive, or beyond the Nyquist frequency.
    """
    w = finite_samples(frequencies, "frequencies")
    if w.size == 0 or w[0] <= 0.0 or np.any(np.diff(w) <= 0.0):
        raise InputError("frequencies must be positive and rise; sort them and drop 0 and repeats")
    if isinstance(fit, DiscreteFit):
        nyquist = np.pi / fit.model.sample_time
        if w[-1] > nyquist * (1.0 + 1e-9):
            raise InputError(
                f"frequency {w[-1]:g} rad/s is beyond {nyquist:g} rad/s, half the sampling rate "
                "of the discrete model; leave it out"
            )

    def response(coordinates: FloatArray) -> NDArray[Any]:
        if isinstance(fit, ContinuousFit):
            structure, s = fit.structure, 1j * w
            value = np.polyval(structure.numerator(coordinates), s)
            value = value / np.polyval(structure.denominator(coordinates), s)
            return value * np.exp(-s * structure.delay(coordinates))
        back = np.exp(-1j * w * fit.model.sample_time)
        na = len(fit.model.a)
        below = np.polyval([*coordinates[:na][::-1], 1.0], back)
        above = np.polyval(coordinates[na:][::-1], back)
        return above / below * back**fit.model.delay

    value = response(_coordinates(fit))
    magnitude, phase = np.abs(value), np.unwrap(np.angle(value))
    # Log and phase are real and imaginary part of ln G, whose derivative is dG / G.
    half = _half_width(fit, lambda x: response(x) / value)
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


def step_response_band(fit: ContinuousFit | DiscreteFit, time: ArrayLike) -> StepResponse:
    """Return the unit-step response of a fitted model with its 95 % band.

    Args:
        fit: any fit to general inputs.
        time: uniform, from 0; of a discrete model its own samples, shape ``(n,)`` [s].

    Returns:
        The response from rest, offset 0.

    Raises:
        InputError: time does not start at 0, is not uniform, or has another interval than a
            discrete model.
    """
    t = finite_samples(time, "time")
    if t.size < 2 or t[0] != 0.0 or np.any(np.diff(t) <= 0.0):
        raise InputError("time must start at 0 and increase over at least 2 samples; shift it")
    interval = uniform_interval(t)
    if isinstance(fit, DiscreteFit):
        own = fit.model.sample_time
        if abs(interval - own) > 1e-3 * own:
            raise InputError(
                f"time has interval {interval:g} s but the model is sampled at {own:g} s; use its "
                "own sample times"
            )

    def response(coordinates: FloatArray) -> FloatArray:
        if isinstance(fit, DiscreteFit):
            na = len(fit.model.a)
            above = np.append(np.zeros(fit.model.delay), coordinates[na:])
            return _lfilter(above, np.append(1.0, coordinates[:na]), np.ones(t.size))
        structure = fit.structure
        step = np.append(0.0, np.ones(t.size))
        columns = chain_derivatives(
            structure.constants(coordinates),
            step,
            interval,
            count=structure.zeros + 1,
            dead_time=structure.delay(coordinates),
        )
        return (columns @ coordinates[structure.searched :])[1:]

    output = response(_coordinates(fit))
    half = _half_width(fit, response)
    band = None if half is None else np.stack([output - half, output + half])
    return StepResponse(t, output, band)


def _coordinates(fit: ContinuousFit | DiscreteFit) -> FloatArray:
    if isinstance(fit, ContinuousFit):
        return fit.coordinates
    return np.array([*fit.model.a, *fit.model.b])


def _half_width(
    fit: ContinuousFit | DiscreteFit, values: Callable[[FloatArray], NDArray[Any]]
) -> NDArray[Any] | None:
    """Return half widths of 95 % bands; of complex values those of both parts."""
    covariance = fit.covariance
    if covariance is None:
        return None
    at = _coordinates(fit)
    columns: list[NDArray[Any]] = []
    for i in range(at.size):
        step = np.zeros(at.size)
        step[i] = _STEP * max(abs(float(at[i])), 1e-3)
        columns.append((values(at + step) - values(at - step)) / (2.0 * step[i]))
    slopes = np.column_stack(columns)

    def spread(part: FloatArray) -> FloatArray:
        return np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", part, covariance, part), 0.0))

    if np.iscomplexobj(slopes):
        return _NORMAL * (spread(np.real(slopes)) + 1j * spread(np.imag(slopes)))
    return _NORMAL * spread(slopes)


def _listed(band: FloatArray | None) -> list[list[float]] | None:
    return None if band is None else band.T.tolist()
