"""Hidden effects of the sensors."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from scipy.signal import lsim

from pamsim.core.units import FloatArray
from pamsim.recordings.recording import Recording
from pamsim.recordings.sensors import MeasurementChain
from tests.plant.hidden.hidden_effect import PlantEffect, Quantities, Quantity, stated
from tests.plant.read_rig import Numbers

_BENT = 0.25
"""Relative change of a sensor's error over its range."""

_ANGLE_SPAN, _PRESSURE_SPAN = 0.5, 3e5
"""[rad], [Pa]"""

_WARM_UP = 2.0
"""Time in which a sensor's offset settles [s]."""

_PHASE = 1.0
"""Where the eccentric encoder's error vanishes, before angle 0 [rad]."""


def behind(time: FloatArray, signal: FloatArray, *lags: float) -> FloatArray:
    """A signal behind lags in series, at rest before its first sample.

    Args:
        time: (n,) uniform [s].
        signal: (n,) or (n, m).
        lags: time constants [s].
    """
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
    return dataclasses.replace(
        run.with_angle(chain.angle_scale * angle + chain.angle_bias),
        pressure=chain.pressure_scale * pressure + chain.pressure_bias,
    )


def _angle_lag(run: Recording, size: float) -> Recording:
    return run.with_angle(behind(run.time, run.angle, 0.5 * size, 0.5 * size))


def _pressure_lag(run: Recording, size: float) -> Recording:
    late = behind(run.time, run.pressure, 0.5 * size, 0.5 * size)
    return dataclasses.replace(run, pressure=late)


def _bent(run: Recording, size: float) -> Recording:
    error = size * run.angle * (1.0 + _BENT * run.angle / _ANGLE_SPAN)
    return run.with_angle(run.angle + error)


def _warming(run: Recording, size: float) -> Recording:
    error = size * (1.0 + _BENT * (np.exp(-run.time / _WARM_UP) - 0.5))
    return run.with_angle(run.angle + error)


def _eccentric(run: Recording, size: float) -> Recording:
    return run.with_angle(run.angle + size * np.sin(run.angle + _PHASE))


def _saturating(run: Recording, size: float) -> Recording:
    error = size * run.pressure * (1.0 + _BENT * (1.0 - run.pressure / _PRESSURE_SPAN))
    return dataclasses.replace(run, pressure=run.pressure + error)


def _drifting(run: Recording, size: float) -> Recording:
    error = size * (1.0 + _BENT * (run.pressure / _PRESSURE_SPAN - 1.0))
    return dataclasses.replace(run, pressure=run.pressure + error)


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
        "error_at_zero": Quantity(value=size * math.sin(_PHASE), unit="rad"),
        "error_amplitude": Quantity(value=size, unit="rad"),
    }


EFFECTS = (
    PlantEffect(
        name="angle_filter",
        formulation="the angle behind a critically damped filter of second order",
        stands_for=("angle_lag",),
        unit="s",
        typical=0.01,
        sensed=_angle_lag,
        measure=stated("sum_of_time_constants", "s"),
        library=lambda size, *_: {"sensor.angle_lag": size},
    ),
    PlantEffect(
        name="bent_angle_scale",
        formulation="a wrong and slightly nonlinear scale of the angle",
        stands_for=("angle_scale",),
        unit="1",
        typical=0.03,
        sensed=_bent,
        measure=stated("relative_error", "1"),
        library=lambda size, *_: {"sensor.angle_scale": 1.0 + size},
        signed=True,
    ),
    PlantEffect(
        name="warming_encoder",
        formulation="an offset of the angle that falls by a quarter while the encoder warms up",
        stands_for=("angle_bias",),
        unit="rad",
        typical=0.01,
        sensed=_warming,
        measure=stated("mean_offset", "rad"),
        library=lambda size, *_: {"sensor.angle_bias": size},
        signed=True,
    ),
    PlantEffect(
        name="eccentric_encoder",
        formulation="an encoder off the shaft's axis: an error with one period per turn",
        family="angle_sensor",
        unit="rad",
        typical=0.02,
        sensed=_eccentric,
        measure=_eccentric_error,
        signed=True,
    ),
    PlantEffect(
        name="slow_clock",
        formulation="a logger whose clock is slow: its samples lie further and further apart",
        unit="1",
        typical=0.01,
        sensed=_slow_clock,
        measure=stated("relative_error_of_the_period", "1"),
    ),
    PlantEffect(
        name="pressure_filter",
        formulation="the pressures behind critically damped filters of second order",
        stands_for=("pressure_lag",),
        unit="s",
        typical=0.01,
        sensed=_pressure_lag,
        measure=stated("sum_of_time_constants", "s"),
        library=lambda size, *_: {"sensor.pressure_lag": size},
    ),
    PlantEffect(
        name="bent_pressure_scale",
        formulation="a scale error of the pressures that falls with pressure",
        stands_for=("pressure_scale",),
        unit="1",
        typical=0.02,
        sensed=_saturating,
        measure=stated("relative_error_at_3_bar", "1"),
        library=lambda size, *_: {"sensor.pressure_scale": 1.0 + size},
        signed=True,
    ),
    PlantEffect(
        name="drifting_pressure_zero",
        formulation="an offset of the pressures that changes with pressure",
        stands_for=("pressure_bias",),
        unit="Pa",
        typical=3e3,
        sensed=_drifting,
        measure=stated("offset_at_3_bar", "Pa"),
        library=lambda size, *_: {"sensor.pressure_bias": size},
        signed=True,
    ),
)
"""Hidden effects of the sensors."""
