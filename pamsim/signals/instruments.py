"""Measurement models of common instruments with their uncertainties.

A maker's accuracy is a limit that holds for every reading. Without further knowledge errors inside
a limit +-a are taken as uniform, with standard uncertainty a / sqrt(3); a resolution q leaves
+-q/2 (GUM, JCGM 100:2008, 4.3.7). Expanded uncertainty is k = 2 times the standard one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pamsim.core.parameters import ParameterGroup, parameter

FloatArray = NDArray[np.float64]

ICE_POINT = 273.15
"""0 deg C [K]."""

SOUND_AT_ICE_POINT = 331.3
"""Speed of sound in dry air at 0 deg C [m/s] (Kinsler et al., Fundamentals of Acoustics)."""


@dataclass(frozen=True, kw_only=True)
class VoltageTransducer(ParameterGroup):
    """Pressure transducer with a voltage linear in pressure (Alraouf 2025, equation (5))."""

    group: ClassVar[str] = "transducer"
    zero_voltage: float = parameter(unit="V", low=-20.0, high=20.0, doc="output at no pressure")
    span_voltage: float = parameter(
        unit="V", low=0.0, high=20.0, low_open=True, doc="change of output over the full scale"
    )
    full_scale: float = parameter(
        unit="Pa", low=0.0, high=1e8, low_open=True, doc="pressure at the end of the range"
    )
    accuracy: float = parameter(
        unit="1", low=0.0, high=0.5, doc="largest error, as a share of full scale"
    )


@dataclass(frozen=True, kw_only=True)
class UltrasonicRanger(ParameterGroup):
    """Distance by the echo time of an ultrasonic pulse (Alraouf 2025, equation (6))."""

    group: ClassVar[str] = "ranger"
    echo_time_per_length: float = parameter(
        unit="s/m", low=0.0, high=1.0, low_open=True, doc="echo time the program takes for 1 m"
    )
    accuracy: float = parameter(unit="m", low=0.0, high=1.0, doc="largest error at its calibration")


@dataclass(frozen=True, kw_only=True)
class IncrementalEncoder(ParameterGroup):
    """Incremental shaft encoder (Matiskova 2021, section 2.3)."""

    group: ClassVar[str] = "encoder"
    increments: float = parameter(unit="1", low=4.0, high=1e7, doc="increments per revolution")


@dataclass(frozen=True, kw_only=True)
class Converter(ParameterGroup):
    """Analogue-to-digital converter (Alraouf 2025, calibration; Matiskova 2021, section 2.4)."""

    group: ClassVar[str] = "converter"
    bits: float = parameter(unit="1", low=4.0, high=32.0, doc="bits of a reading")
    span: float = parameter(
        unit="V", low=0.0, high=100.0, low_open=True, doc="width of the input range"
    )


def transducer_pressure(voltage: ArrayLike, device: VoltageTransducer) -> FloatArray:
    """Pressure a voltage means: (V - V0) / span times full scale (Alraouf 2025, equation (5)).

    Args:
        voltage: (...) [V].
        device: the transducer.

    Returns:
        (...) gauge pressure [Pa].
    """
    share = (np.asarray(voltage, dtype=np.float64) - device.zero_voltage) / device.span_voltage
    return share * device.full_scale


def transducer_limit(device: VoltageTransducer) -> float:
    """Largest error of the transducer [Pa]."""
    return device.accuracy * device.full_scale


def converter_step(device: Converter) -> float:
    """Resolution as a voltage [V]: the range over 2^bits."""
    return device.span / 2.0**device.bits


def pressure_resolution(transducer: VoltageTransducer, converter: Converter) -> float:
    """Resolution as a pressure [Pa]."""
    return converter_step(converter) / transducer.span_voltage * transducer.full_scale


def encoder_step(device: IncrementalEncoder) -> float:
    """Resolution as an angle [rad]."""
    return 2.0 * math.pi / device.increments


def speed_of_sound(temperature: ArrayLike) -> FloatArray:
    """Speed of sound in dry air as an ideal gas, c = c0 sqrt(T / T0).

    Args:
        temperature: (...) T [K].

    Returns:
        (...) c [m/s].
    """
    return SOUND_AT_ICE_POINT * np.sqrt(np.asarray(temperature, dtype=np.float64) / ICE_POINT)


def sound_temperature_coefficient(temperature: float) -> float:
    """Relative change of the speed of sound per kelvin, d ln c / dT = 1 / (2 T) [1/K]."""
    return 0.5 / temperature


def ranged_length(echo_time: ArrayLike, device: UltrasonicRanger) -> FloatArray:
    """Distance the program makes of an echo time (Alraouf 2025, equation (6)).

    Args:
        echo_time: (...) there and back [s].
        device: the ranger.

    Returns:
        (...) distance [m].
    """
    return np.asarray(echo_time, dtype=np.float64) / device.echo_time_per_length


def ranger_temperature(device: UltrasonicRanger) -> float:
    """Temperature at which the ranger reads true [K]: where the program's speed is that of sound.

    The program takes 2 / c of echo time per metre.
    """
    assumed = 2.0 / device.echo_time_per_length
    return ICE_POINT * (assumed / SOUND_AT_ICE_POINT) ** 2


def ranger_reading(length: ArrayLike, temperature: float, device: UltrasonicRanger) -> FloatArray:
    """What the ranger reads of a true distance in air of another temperature.

    Args:
        length: (...) true distance [m].
        temperature: of the air [K].
        device: the ranger.

    Returns:
        (...) reading [m]: too short in warm air, by about half the relative change of T.
    """
    echo = 2.0 * np.asarray(length, dtype=np.float64) / speed_of_sound(temperature)
    return ranged_length(echo, device)


def uncertainty_of_limit(limit: float) -> float:
    """Standard uncertainty of errors uniform within +-limit, in any unit (GUM 4.3.7)."""
    return limit / math.sqrt(3.0)


def uncertainty_of_resolution(step: float) -> float:
    """Standard uncertainty a resolution leaves, in one unit: step / sqrt(12) (GUM F.2.2.1)."""
    return uncertainty_of_limit(0.5 * step)


def expanded_uncertainty(*standard: float) -> float:
    """Expanded uncertainty, k = 2, of independent standard uncertainties in one unit."""
    return 2.0 * math.hypot(*standard)
