"""Instruments of the environments: lag, scale, bias, noise and rounding."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pamsim.envs.settings import ArmSettings
from pamsim.signals.sensors import MeasurementChain

FloatArray = NDArray[np.float64]


class Gauge(NamedTuple):
    """Encoder and pressure transducers; columns are angle and both pressures.

    Attributes:
        scale: (n, 3) reading per true change.
        bias: (n, 3) reading at zero [rad, Pa, Pa].
        done: (n, 3) share of a jump that a lag makes up within a period; 1 without lag.
        along: (n, 3) share of a change spread evenly over it.
        noise: (3,) standard deviations.
        step: (3,) resolution; 0 for unlimited.
        held: (n, 3) memory: signals behind their lags.
        before: (n, 3) memory: true signals of the last sample.
    """

    scale: FloatArray
    bias: FloatArray
    done: FloatArray
    along: FloatArray
    noise: FloatArray
    step: FloatArray
    held: FloatArray
    before: FloatArray


def instruments(settings: ArmSettings, chain: MeasurementChain | None, arms: int) -> Gauge:
    """Instruments of a number of arms.

    Args:
        settings: noise, and whether encoder and converter round.
        chain: of the rig; None if it states none.
        arms: how many.
    """
    own = chain or MeasurementChain()
    increments = own.encoder_increments if settings.instruments else 0.0
    converter = own.pressure_step if settings.instruments else 0.0
    return Gauge(
        scale=np.ones((arms, 3)),
        bias=np.zeros((arms, 3)),
        done=np.ones((arms, 3)),
        along=np.ones((arms, 3)),
        noise=np.array([settings.angle_noise, *[settings.pressure_noise] * 2]),
        step=np.array([2.0 * math.pi / increments if increments else 0.0, *[converter] * 2]),
        held=np.zeros((arms, 3)),
        before=np.zeros((arms, 3)),
    )


def set_errors(gauge: Gauge, arm: int, chain: MeasurementChain | None, period: float) -> None:
    """Give one arm's instruments their scale, bias and lag.

    Args:
        gauge: changed in place.
        arm: which.
        chain: what they err by; None for nothing.
        period: between samples [s].
    """
    own = chain or MeasurementChain()
    gauge.scale[arm] = own.angle_scale, own.pressure_scale, own.pressure_scale
    gauge.bias[arm] = own.angle_bias, own.pressure_bias, own.pressure_bias
    for column, lag in enumerate((own.angle_lag, own.pressure_lag, own.pressure_lag)):
        ratio = period / lag if lag > 0.0 else math.inf
        done = -math.expm1(-ratio)
        gauge.done[arm, column] = done
        gauge.along[arm, column] = 1.0 - done / ratio
