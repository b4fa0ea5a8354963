"""Pressure in a muscle's chamber, from its air and the volume at its length.

``m`` are the parameters of one actuator, ``s`` its states and ``z`` its memory of hysteresis, see
`pamsim.physics.record`.
"""

from __future__ import annotations

import math

from pamsim.physics.chamber import absolute_pressure
from pamsim.physics.muscle_hysteresis import hysteresis_volume
from pamsim.physics.record import Parameters, Row, States
from pamsim.physics.static_muscle import (
    contraction,
    length_at_muscle,
    rigid_volume,
    static_volume,
    volume_and_slope,
    volume_at_nominal_length,
    volume_varies,
)
from pamsim.physics.valves import MEASURED

_TYPICAL_PRESSURE = 3e5  # gauge [Pa]: where a volume that depends on it is taken to begin with
_CLOSE = 3e-6  # relative step that may be the last of the pressure search
_LEFT = 1e-11  # and relative error that it may leave, if the next step shrinks as it did


def chamber_volume(m: Parameters, z: Row, tendon_length: float, pressure: float) -> float:
    """Volume of the air [m^3], hysteresis included; the pressure is gauge, see `static_volume`."""
    kappa = contraction(m, tendon_length)
    return static_volume(m, tendon_length, pressure) + hysteresis_volume(m, z, kappa)


def chamber_pressure(m: Parameters, s: States, z: Row, tendon_length: float) -> float:
    """Absolute pressure in the chamber [Pa].

    States of zero, as ``mj_resetData`` leaves them, are a chamber at the atmosphere; a measured
    pressure is the state itself. NaN without volume, beyond straight fibres, so that the run stops.
    """
    if not (s.air > 0.0 or s.air == 0.0):
        return math.nan
    if m.command == MEASURED:
        return s.air if s.air > 0.0 else m.chamber.atmosphere
    length = length_at_muscle(m, s, tendon_length)
    if s.air == 0.0:
        return m.chamber.atmosphere if chamber_volume(m, z, length, 0.0) > 0.0 else math.nan
    kappa = contraction(m, length)
    fixed = volume_at_nominal_length(m) + hysteresis_volume(m, z, kappa)
    if volume_varies(m) and s.last_pressure > 0.0:
        # Going on as in the last two steps leaves so little that the search mostly ends there.
        first = 2.0 * s.last_pressure - s.earlier_pressure
        if not 0.5 * s.last_pressure < first < 2.0 * s.last_pressure:
            first = s.last_pressure
        return consistent_pressure(m, s.air, fixed, kappa, first)
    inside = fixed + rigid_volume(m, kappa, _TYPICAL_PRESSURE)
    pressure = _TYPICAL_PRESSURE + m.chamber.atmosphere
    if inside > 0.0:
        pressure = absolute_pressure(m.chamber, s.air, inside)
    if volume_varies(m):
        return consistent_pressure(m, s.air, fixed, kappa, pressure)
    return pressure if inside > 0.0 else math.nan


def consistent_pressure(
    m: Parameters, air: float, fixed: float, kappa: float, first: float
) -> float:
    """Absolute pressure at which air and a volume that depends on it agree [Pa].

    By Newton's method, kept between pressures that are too low and too high: a volume that grows or
    hardly shrinks with pressure leaves one solution. ``fixed`` is the volume's other part [m^3].
    """
    low, high, index = m.chamber.floor, math.inf, m.chamber.polytropic_index
    pressure, before = first, math.inf
    for _ in range(100):
        gained, slope = volume_and_slope(m, kappa, pressure - m.chamber.atmosphere)
        inside = fixed + gained
        if not inside > 0.0:
            return math.nan
        wanted = absolute_pressure(m.chamber, air, inside)
        if wanted > pressure:
            low = pressure
        else:
            high = pressure
        following = pressure + (wanted - pressure) / (1.0 + index * wanted * slope / inside)
        if not low < following < high:
            following = wanted
        step = abs(following - pressure)
        if step <= _CLOSE * pressure and step * step <= _LEFT * pressure * before:
            return following
        pressure, before = following, step
    return pressure


def gauge_pressure(m: Parameters, s: States, z: Row, tendon_length: float) -> float:
    """Gauge pressure in the chamber [Pa]."""
    return chamber_pressure(m, s, z, tendon_length) - m.chamber.atmosphere
