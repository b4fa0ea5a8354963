"""Its sensors: equations (5) and (6), resolutions, accuracies, critical angle.

A maker's accuracy is a limit that holds for every reading. Without further knowledge errors inside
a limit +-a are taken as uniform, with standard uncertainty a / sqrt(3); the expanded uncertainty is
twice the standard one (GUM, JCGM 100:2008, 4.3.7).
"""

from __future__ import annotations

import math

from pamsim.core.units import DEG_PER_RAD
from pamsim.papers.alraouf2025.loop import measured_gap
from pamsim.papers.claim import Recomputed, recomputes
from pamsim.papers.numerics import PrintedNumbers, half_unit, propagated
from pamsim.recordings.printed import Printed

_TRANSDUCER, _CONVERTER, RANGER = (
    PrintedNumbers("alraouf2025", table) for table in ("transducer", "converter", "ranger")
)
_LABORATORY = (20.0, 30.0)  # deg C, printed
_ICE_POINT = 273.15  # K
_SOUND_AT_ICE_POINT = 331.3  # m/s, dry air (Kinsler et al., Fundamentals of Acoustics)
_SOUND_PER_KELVIN = 0.606  # m/s per K, the linear law of handbooks, its slope at 0 deg C


def transducer_pressure(voltage: float) -> float:
    """Equation (5): gauge pressure [kPa] of a voltage [V]."""
    zero, span, scale = map(_TRANSDUCER.value, ("zero_voltage", "span_voltage", "full_scale"))
    return (voltage - zero) / span * scale


def _resolution(bits: float) -> float:
    """Pressure [kPa] of one step of a converter."""
    volts = _CONVERTER.value("span") / 2.0**bits
    return transducer_pressure(volts) - transducer_pressure(0.0)


@recomputes("alraouf2025-56")
def _transducer_limit() -> Printed:
    """Largest error of the transducer [kPa]."""
    numbers = map(_TRANSDUCER.digits, ("accuracy", "full_scale"))
    return propagated(lambda percent, scale: 0.01 * percent * scale, *numbers)


def speed_of_sound(celsius: float) -> float:
    """Speed of sound in dry air as an ideal gas [m/s]."""
    return _SOUND_AT_ICE_POINT * math.sqrt((celsius + _ICE_POINT) / _ICE_POINT)


def ranger_speed(echo_time: float) -> float:
    """Speed of sound [m/s] that (6) assumes with an echo time there and back [us/cm]."""
    return 2.0 / (1e-4 * echo_time)


@recomputes("alraouf2025-54")
def _ends() -> list[float]:
    return [transducer_pressure(0.5), transducer_pressure(4.5)]


@recomputes("alraouf2025-55")
def _step() -> Recomputed:
    bits, span = _CONVERTER.value("bits"), _CONVERTER.value("span")
    listed = ", ".join(f"{other} bits {_resolution(other):.2f}" for other in (8, 12))
    return Recomputed(_resolution(bits), bits=bits, span=span, listed=listed)


@recomputes("alraouf2025-57")
def _expanded() -> Recomputed:
    limit = _transducer_limit()
    return Recomputed(
        propagated(lambda standard: 2.0 * standard, limit),
        uniform=2.0 * limit.value / math.sqrt(3.0),
    )


@recomputes("alraouf2025-58")
def _echo() -> Recomputed:
    low, high = (Printed(end, half_unit(0)) for end in _LABORATORY)
    celsius = propagated(
        lambda time: _ICE_POINT * (ranger_speed(time) / _SOUND_AT_ICE_POINT) ** 2 - _ICE_POINT,
        RANGER.digits("echo_time_per_length"),
    )
    speed = ranger_speed(RANGER.value("echo_time_per_length"))
    return Recomputed(celsius, printed=_LABORATORY, low=low, high=high, speed=speed)


@recomputes("alraouf2025-59")
def _range_accuracy() -> float:
    return 1e-3 * RANGER.value("accuracy") / (speed_of_sound(_LABORATORY[0]) / 40e3)


@recomputes("alraouf2025-60")
def _per_kelvin() -> Recomputed:
    middle = sum(_LABORATORY) / 2.0
    linear = _SOUND_PER_KELVIN / (_SOUND_AT_ICE_POINT + _SOUND_PER_KELVIN * middle)
    # d ln c / dT = 1 / (2 T) of an ideal gas
    return Recomputed(100.0 * linear, middle=middle, exact=50.0 / (_ICE_POINT + middle))


@recomputes("alraouf2025-61")
def _laboratory() -> Recomputed:
    # A reading is too short by the share by which sound is faster than (6) assumes.
    speed = ranger_speed(RANGER.value("echo_time_per_length"))
    cold, warm = (30.0 * speed / speed_of_sound(celsius) for celsius in _LABORATORY)
    return Recomputed(cold - warm, width=measured_gap()[0].value)


@recomputes("alraouf2025-62")
def _critical_angle() -> float:
    return math.acos(1.0 / math.sqrt(3.0)) * DEG_PER_RAD


@recomputes("alraouf2025-64")
def _negligible_step() -> Recomputed:
    step, limit = _resolution(_CONVERTER.value("bits")), _transducer_limit().value
    return Recomputed(math.hypot(limit, step) - limit, high=half_unit(0), step=step)
