"""Sensors that err, formulated otherwise."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from pamsim.core.recording import Recording
from pamsim.effects.catalog import effect
from pamsim.signals.sensors import lagged
from pamsim.twins.independent_models.independent_model import Truth

FloatArray = NDArray[np.float64]
_Error = Callable[[FloatArray, float], FloatArray]

_ECCENTRIC = 0.25
"""How much the offset of the encoder changes per radian, of itself."""

_BENT = 0.25
"""How much the error of the angle's scale changes within `_ANGLE_SPAN`, of itself."""

_ANGLE_SPAN = 0.5
"""[rad]"""

_PRESSURE_SPAN = 3e5
"""Pressure about which the transducers' errors change [Pa]."""


def two_lags(time: FloatArray, signal: FloatArray, lag: float) -> FloatArray:
    """A signal behind a critically damped filter of second order.

    Args:
        time: (n,) [s].
        signal: (n,) or (n, m), at rest before its first sample.
        lag: sum of its two time constants [s].
    """
    return lagged(time, lagged(time, signal, 0.5 * lag), 0.5 * lag)


def eccentric_bias(angle: FloatArray, bias: float) -> FloatArray:
    """What an encoder that sits off its axis adds to an angle [rad]."""
    return bias * (1.0 + _ECCENTRIC * np.sin(angle))


def bent_scale(angle: FloatArray, more: float) -> FloatArray:
    """What a scale that is off, and not quite straight, adds to an angle [rad]."""
    return more * angle * (1.0 + _BENT * angle / _ANGLE_SPAN)


def drifting_bias(pressure: FloatArray, bias: float) -> FloatArray:
    """What a transducer whose offset depends a little on its load adds to a pressure [Pa]."""
    return bias * (1.0 + _BENT * (pressure / _PRESSURE_SPAN - 1.0))


def saturating_scale(pressure: FloatArray, more: float) -> FloatArray:
    """What a transducer adds to a pressure whose error of scale lessens with it [Pa]."""
    return more * pressure * (1.0 + _BENT * (1.0 - pressure / _PRESSURE_SPAN))


def _angle(error: _Error, name: str) -> Callable[[Recording, float], Recording]:
    typical = effect(name).parameters[0].typical

    def seen(run: Recording, size: float) -> Recording:
        return dataclasses.replace(run, angle=run.angle + error(run.angle, size * typical))

    return seen


def _pressure(error: _Error, name: str) -> Callable[[Recording, float], Recording]:
    typical = effect(name).parameters[0].typical

    def seen(run: Recording, size: float) -> Recording:
        return dataclasses.replace(run, pressure=run.pressure + error(run.pressure, size * typical))

    return seen


def _angle_lag(run: Recording, size: float) -> Recording:
    lag = size * effect("angle_lag").parameters[0].typical
    return dataclasses.replace(run, angle=two_lags(run.time, run.angle, lag))


def _pressure_lag(run: Recording, size: float) -> Recording:
    lag = size * effect("pressure_lag").parameters[0].typical
    return dataclasses.replace(run, pressure=two_lags(run.time, run.pressure, lag))


TRUTHS = (
    Truth(
        name="angle_lag",
        formulation="a critically damped filter of second order",
        seen=_angle_lag,
    ),
    Truth(
        name="angle_scale",
        formulation="a scale that is off and not quite straight",
        seen=_angle(bent_scale, "angle_scale"),
        signed=True,
    ),
    Truth(
        name="angle_bias",
        formulation="an encoder off its axis: an offset that changes with the angle",
        seen=_angle(eccentric_bias, "angle_bias"),
        signed=True,
    ),
    Truth(
        name="pressure_lag",
        formulation="a critically damped filter of second order",
        seen=_pressure_lag,
    ),
    Truth(
        name="pressure_scale",
        formulation="an error of scale that lessens with the pressure",
        seen=_pressure(saturating_scale, "pressure_scale"),
        signed=True,
    ),
    Truth(
        name="pressure_bias",
        formulation="an offset that changes with the pressure",
        seen=_pressure(drifting_bias, "pressure_bias"),
        signed=True,
    ),
)
"""Truths of the sensors."""
