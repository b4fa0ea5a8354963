"""Hidden effects of the sensors."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from functools import partial
from typing import TypeAlias

import numpy as np
from scipy.signal import lsim

from pamsim.core.units import FloatArray
from pamsim.recordings.recording import Recording
from pamsim.recordings.sensors import MeasurementChain
from tests.plant.hidden.hidden_effect import PlantEffect, Quantities, Quantity
from tests.plant.read_rig import Numbers

Sensed: TypeAlias = Callable[[Recording, float], Recording]

_BENT = 0.25
"""Relative change of a sensor's error over its range."""

_ANGLE_SPAN, _PRESSURE_SPAN = 0.5, 3e5
"""[rad], [Pa]"""

_WARM_UP = 2.0
"""Time in which a sensor's offset settles [s]."""

_PHASE = 1.0
"""Where the eccentric encoder's error vanishes, before angle 0 [rad]."""


def behind(time: FloatArray, signal: FloatArray, *lags: float) -> FloatArray:
    """A signal (n,) or (n, m) behind lags in series [s], at rest before its first sample."""
    below = np.array([1.0])
    for lag in lags:
        below = np.polymul(below, [lag, 1.0])
    start = signal[0]
    columns = (signal - start).reshape(len(time), -1)
    out = [lsim(([1.0], below), column, time)[1] for column in columns.T]
    return start + np.stack(out, axis=1).reshape(signal.shape)


def reported(run: Recording, chain: MeasurementChain) -> Recording:
    """A recording as a rig's sensors report it: behind their lag, scaled, with their offset."""
    angle, pressure = run.angle, run.pressure
    if chain.angle_lag > 0.0:
        angle = behind(run.time, angle, chain.angle_lag)
    if chain.pressure_lag > 0.0:
        pressure = behind(run.time, pressure, chain.pressure_lag)
    bent = chain.angle_bend * angle**2
    pressed = chain.pressure_scale * pressure + chain.pressure_bend * pressure**2
    return dataclasses.replace(
        run.with_angle(chain.angle_scale * angle + bent + chain.angle_bias),
        pressure=pressed + chain.pressure_bias,
    )


def periodic_error(
    angle: FloatArray, amplitude: float, periods: float = 1.0, phase: float = _PHASE
) -> FloatArray:
    """Error [rad] of so many periods per turn at angles (n,) [rad]."""
    return amplitude * np.sin(periods * angle + phase)


def _angle_error(error: Callable[[Recording, float], FloatArray]) -> Sensed:
    """The angle with an error, of a recording and the effect's size."""
    return lambda run, size: run.with_angle(run.angle + error(run, size))


def _pressure_error(error: Callable[[Recording, float], FloatArray]) -> Sensed:
    """The pressures with one."""
    return lambda run, size: dataclasses.replace(run, pressure=run.pressure + error(run, size))


def _twice_behind(run: Recording, signal: FloatArray, size: float) -> FloatArray:
    return behind(run.time, signal, 0.5 * size, 0.5 * size)


def _slow_clock(run: Recording, size: float) -> Recording:
    late = (1.0 + size) * (run.time - run.time[0]) + run.time[0]

    def read(signal: FloatArray) -> FloatArray:
        return np.apply_along_axis(lambda column: np.interp(late, run.time, column), 0, signal)

    return dataclasses.replace(
        run,
        positions=read(run.positions),
        pressure=read(run.pressure),
        tension=read(run.tension),
    )


def _eccentric_error(_: Numbers, __: Numbers, size: float) -> Quantities:
    return {
        "error_at_zero": Quantity(size * math.sin(_PHASE), "rad"),
        "error_amplitude": Quantity(size, "rad"),
    }


_angle_scale, _pressure_scale = (
    partial(
        PlantEffect,
        stands_for=(f"{signal}_scale",),
        unit="1",
        library=lambda size, *_, signal=signal: {f"sensor.{signal}_scale": 1.0 + size},
        signed=True,
    )
    for signal in ("angle", "pressure")
)

EFFECTS = (
    PlantEffect(
        name="angle_filter",
        formulation="the angle behind a critically damped filter of second order",
        stands_for=("angle_lag",),
        # To a part in a thousand of the arm's motion it is a dead time.
        resembles=("clock_offset",),
        unit="s",
        typical=0.01,
        sensed=lambda run, size: run.with_angle(_twice_behind(run, run.angle, size)),
        stated="sum_of_time_constants",
        equals="sensor.angle_lag",
    ),
    _angle_scale(
        name="bent_angle_scale",
        formulation="a wrong and slightly nonlinear scale of the angle",
        typical=0.03,
        sensed=_angle_error(
            lambda run, size: size * run.angle * (1.0 + _BENT * run.angle / _ANGLE_SPAN)
        ),
        stated="relative_error",
    ),
    _angle_scale(
        name="unequal_channels",
        formulation="an encoder that reads a magnet by two channels of unequal gain",
        typical=0.03,
        sensed=lambda run, size: run.with_angle(
            np.arctan2((1.0 + size) * np.sin(run.angle), np.cos(run.angle))
        ),
        stated="relative_error",
    ),
    PlantEffect(
        name="warming_encoder",
        formulation="an offset of the angle that falls by a quarter while the encoder warms up",
        stands_for=("angle_bias",),
        unit="rad",
        typical=0.01,
        sensed=_angle_error(
            lambda run, size: size * (1.0 + _BENT * (np.exp(-run.time / _WARM_UP) - 0.5))
        ),
        stated="mean_offset",
        equals="sensor.angle_bias",
        signed=True,
    ),
    PlantEffect(
        name="eccentric_encoder",
        formulation="an encoder off the shaft's axis: an error with one period per turn",
        family="angle_sensor",
        # Over the range of a joint a sine is little else than a straight line.
        resembles=("angle_bias", "angle_scale"),
        unit="rad",
        typical=0.02,
        sensed=_angle_error(lambda run, size: periodic_error(run.angle, size)),
        measure=_eccentric_error,
        signed=True,
    ),
    PlantEffect(
        name="slow_clock",
        formulation="a logger whose clock is slow: its samples lie further and further apart",
        unit="1",
        typical=0.01,
        sensed=_slow_clock,
        stated="relative_error_of_the_period",
    ),
    PlantEffect(
        name="pressure_filter",
        formulation="the pressures behind critically damped filters of second order",
        stands_for=("pressure_lag",),
        unit="s",
        typical=0.01,
        sensed=lambda run, size: dataclasses.replace(
            run, pressure=_twice_behind(run, run.pressure, size)
        ),
        stated="sum_of_time_constants",
        equals="sensor.pressure_lag",
    ),
    _pressure_scale(
        name="bent_pressure_scale",
        formulation="a scale error of the pressures that falls with pressure",
        typical=0.02,
        sensed=_pressure_error(
            lambda run, size: (
                size * run.pressure * (1.0 + _BENT * (1.0 - run.pressure / _PRESSURE_SPAN))
            )
        ),
        stated="relative_error_at_3_bar",
    ),
    _pressure_scale(
        name="power_pressure_scale",
        formulation="an error of the pressures that grows with pressure to the power of 0.75",
        typical=0.02,
        sensed=_pressure_error(
            lambda run, size: (
                size * _PRESSURE_SPAN * (np.maximum(run.pressure, 0.0) / _PRESSURE_SPAN) ** 0.75
            )
        ),
        stated="relative_error_at_3_bar",
    ),
    PlantEffect(
        name="drifting_pressure_zero",
        formulation="an offset of the pressures that changes with pressure",
        stands_for=("pressure_bias",),
        unit="Pa",
        typical=3e3,
        sensed=_pressure_error(
            lambda run, size: size * (1.0 + _BENT * (run.pressure / _PRESSURE_SPAN - 1.0))
        ),
        stated="offset_at_3_bar",
        equals="sensor.pressure_bias",
        signed=True,
    ),
)
"""Hidden effects of the sensors."""
