"""Independent models of sensor errors: second-order lags, nonlinear scale and bias."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from pamsim.core.recording import Recording
from pamsim.effects.catalog import effect
from pamsim.signals.sensors import lagged
from pamsim.twins.independent_models.independent_model import IndependentModel

FloatArray = NDArray[np.float64]
_Error = Callable[[FloatArray, float], FloatArray]

_ECCENTRIC = 0.25
"""Relative change of the encoder's offset per radian."""

_BENT = 0.25
"""Relative change of the scale's error within `_ANGLE_SPAN`."""

_ANGLE_SPAN = 0.5
"""[rad]"""

_PRESSURE_SPAN = 3e5
"""Pressure around which the transducers' errors change [Pa]."""


def two_lags(time: FloatArray, signal: FloatArray, lag: float) -> FloatArray:
    """A signal behind a critically damped filter of second order.

    Args:
        time: (n,) [s].
        signal: (n,) or (n, m), at rest before its first sample.
        lag: sum of its two time constants [s].
    """
    return lagged(time, lagged(time, signal, 0.5 * lag), 0.5 * lag)


def eccentric_bias(angle: FloatArray, bias: float) -> FloatArray:
    """Error of an eccentric encoder [rad]."""
    return bias * (1.0 + _ECCENTRIC * np.sin(angle))


def bent_scale(angle: FloatArray, more: float) -> FloatArray:
    """Error of a wrong and slightly nonlinear scale of an angle [rad]."""
    return more * angle * (1.0 + _BENT * angle / _ANGLE_SPAN)


def drifting_bias(pressure: FloatArray, bias: float) -> FloatArray:
    """Error of a transducer whose offset depends slightly on the pressure [Pa]."""
    return bias * (1.0 + _BENT * (pressure / _PRESSURE_SPAN - 1.0))


def saturating_scale(pressure: FloatArray, more: float) -> FloatArray:
    """Error of a transducer whose scale error falls with the pressure [Pa]."""
    return more * pressure * (1.0 + _BENT * (1.0 - pressure / _PRESSURE_SPAN))


def _angle(error: _Error, name: str) -> Callable[[Recording, float], Recording]:
    typical = effect(name).parameters[0].typical

    def measured(run: Recording, size: float) -> Recording:
        return dataclasses.replace(run, angle=run.angle + error(run.angle, size * typical))

    return measured


def _pressure(error: _Error, name: str) -> Callable[[Recording, float], Recording]:
    typical = effect(name).parameters[0].typical

    def measured(run: Recording, size: float) -> Recording:
        return dataclasses.replace(run, pressure=run.pressure + error(run.pressure, size * typical))

    return measured


def _angle_lag(run: Recording, size: float) -> Recording:
    lag = size * effect("angle_lag").parameters[0].typical
    return dataclasses.replace(run, angle=two_lags(run.time, run.angle, lag))


def _pressure_lag(run: Recording, size: float) -> Recording:
    lag = size * effect("pressure_lag").parameters[0].typical
    return dataclasses.replace(run, pressure=two_lags(run.time, run.pressure, lag))


MODELS = (
    IndependentModel(
        name="angle_lag",
        formulation="a critically damped filter of second order",
        measured=_angle_lag,
    ),
    IndependentModel(
        name="angle_scale",
        formulation="a wrong and slightly nonlinear scale",
        measured=_angle(bent_scale, "angle_scale"),
        signed=True,
    ),
    IndependentModel(
        name="angle_bias",
        formulation="an eccentric encoder: an offset that changes with the angle",
        measured=_angle(eccentric_bias, "angle_bias"),
        signed=True,
    ),
    IndependentModel(
        name="pressure_lag",
        formulation="a critically damped filter of second order",
        measured=_pressure_lag,
    ),
    IndependentModel(
        name="pressure_scale",
        formulation="a scale error that falls with the pressure",
        measured=_pressure(saturating_scale, "pressure_scale"),
        signed=True,
    ),
    IndependentModel(
        name="pressure_bias",
        formulation="an offset that changes with the pressure",
        measured=_pressure(drifting_bias, "pressure_bias"),
        signed=True,
    ),
)
"""Independent models of the measurement effects."""
