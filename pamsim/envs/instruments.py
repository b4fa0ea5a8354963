"""Instruments of the environments: lag, scale, bias, noise and rounding."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pamsim.engine.rig import Rig
from pamsim.envs.settings import EnvSettings
from pamsim.recordings.sensors import MeasurementChain

FloatArray = NDArray[np.float64]


class Gauge(NamedTuple):
    """Encoders and pressure transducers; columns are positions of joints, then pressures.

    Attributes:
        scale: (n, s) reading per true change.
        bias: (n, s) reading at zero [rad or m, Pa].
        done: (n, s) share of a jump that a lag makes up within a period; 1 without lag.
        along: (n, s) share of a change spread evenly over it.
        noise: (s,) standard deviations.
        step: (s,) resolution; 0 for unlimited.
        held: (n, s) memory: signals behind their lags.
        before: (n, s) memory: true signals of the last sample.
    """

    scale: FloatArray
    bias: FloatArray
    done: FloatArray
    along: FloatArray
    noise: FloatArray
    step: FloatArray
    held: FloatArray
    before: FloatArray


def instruments(settings: EnvSettings, rig: Rig, rigs: int) -> Gauge:
    """Instruments of a number of rigs.

    Args:
        settings: noise, and whether encoders and converters round.
        rig: of the environment; an encoder counts parts of a turn, so that it reads joints which
            slide without rounding.
        rigs: how many.
    """
    own = rig.sensor or MeasurementChain()
    increments = own.encoder_increments if settings.instruments else 0.0
    converter = own.pressure_step if settings.instruments else 0.0
    turn = 2.0 * math.pi / increments if increments else 0.0
    muscles = len(rig.muscles)
    steps = [turn if kind == "angle" else 0.0 for kind in rig.joints.values()]
    noise = [settings.angle_noise] * len(steps) + [settings.pressure_noise] * muscles
    size = rigs, len(noise)
    return Gauge(
        scale=np.ones(size),
        bias=np.zeros(size),
        done=np.ones(size),
        along=np.ones(size),
        noise=np.array(noise),
        step=np.array(steps + [converter] * muscles),
        held=np.zeros(size),
        before=np.zeros(size),
    )


def set_errors(gauge: Gauge, number: int, rig: Rig, period: float) -> None:
    """Give one rig's instruments their scale, bias and lag.

    Args:
        gauge: changed in place.
        number: of the rig.
        rig: whose measurement chain states what they err by.
        period: between samples [s].
    """
    own = rig.sensor or MeasurementChain()
    joints = len(rig.joints)
    for columns, scale, bias, lag in (
        (slice(joints), own.angle_scale, own.angle_bias, own.angle_lag),
        (slice(joints, None), own.pressure_scale, own.pressure_bias, own.pressure_lag),
    ):
        gauge.scale[number, columns] = scale
        gauge.bias[number, columns] = bias
        ratio = period / lag if lag > 0.0 else math.inf
        done = -math.expm1(-ratio)
        gauge.done[number, columns] = done
        gauge.along[number, columns] = 1.0 - done / ratio
