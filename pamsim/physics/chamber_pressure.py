"""Pressure in a muscle's chamber, from its air and the volume at its length.

``m`` are the parameters of one actuator, ``s`` its states and ``z`` its memory of hysteresis, see
`pamsim.physics.record`.
"""

from __future__ import annotations

import math

from pamsim.physics.chamber import absolute_pressure
from pamsim.physics.commands import MEASURED
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

_TYPICAL_PRESSURE = 3e5  # gauge [Pa]: where a volume that depends on it is taken to begin with
_CLOSE = 3e-6  # relative step that may be the last of the pressure search
_LEFT = 1e-11  # and relative error that it may leave, if the next step shrinks as it did


def chamber_volume(m: Parameters, z: Row, tendon_length: float, pressure: float) -> float:
    """Volume of the air [m^3], hysteresis included.

    Args:
        m: parameters.
        z: memory.
        tendon_length: at the muscle [m].
        pressure: gauge pressure [Pa], see `static_volume`.
    """
    kappa = contraction(m, tendon_length)
    return static_volume(m, tendon_length, pressure) + hysteresis_volume(m, z, kappa)


def chamber_pressure(m: Parameters, s: States, z: Row, tendon_length: float) -> float:
    """Absolute pressure in the chamber [Pa].

    States of zero, as ``mj_resetData`` leaves them, are a chamber at the atmosphere. One without
    volume is stretched beyond its fibres and gives NaN, so that the run stops there and not at a
    plausible wrong number. A measured pressure is the state itself.
    """
    if s.air == 0.0:
        return _ambient_pressure(m, s, z, tendon_length)
    if m.command == MEASURED:
        return s.air if s.air > 0.0 else math.nan
    length = length_at_muscle(m, s, tendon_length)
    kappa = contraction(m, length)
    fixed = volume_at_nominal_length(m) + hysteresis_volume(m, z, kappa)
    if not s.air > 0.0:
        return math.nan
    if volume_varies(m):
        first = _search_start(m, s, fixed, kappa)
        return _consistent_pressure(m, s.air, fixed, kappa, first)
    inside = fixed + rigid_volume(m, kappa, _TYPICAL_PRESSURE)
    if not inside > 0.0:
        return math.nan
    return absolute_pressure(s.air, inside, m.chamber.polytropic_index, m.chamber.floor)


def _ambient_pressure(m: Parameters, s: States, z: Row, tendon_length: float) -> float:
    """The atmosphere's pressure [Pa]; NaN where the muscle has no volume."""
    if m.command == MEASURED:
        return m.chamber.atmosphere
    inside = chamber_volume(m, z, length_at_muscle(m, s, tendon_length), 0.0)
    return m.chamber.atmosphere if inside > 0.0 else math.nan


def _search_start(m: Parameters, s: States, fixed: float, kappa: float) -> float:
    """Absolute pressure with which the search for it begins [Pa].

    Going on as in the last two steps leaves so little that the search mostly ends where it begins.
    Without a step before, it is the pressure that a braid of typical length would have.

    Args:
        m: parameters.
        s: states.
        fixed: volume that does not depend on the pressure [m^3].
        kappa: contraction [-].
    """
    last = s.last_pressure
    if last > 0.0:
        going_on = 2.0 * last - s.earlier_pressure
        return going_on if 0.5 * last < going_on < 2.0 * last else last
    inside = fixed + rigid_volume(m, kappa, _TYPICAL_PRESSURE)
    if inside > 0.0:
        return absolute_pressure(s.air, inside, m.chamber.polytropic_index, m.chamber.floor)
    return _TYPICAL_PRESSURE + m.chamber.atmosphere


def _consistent_pressure(
    m: Parameters, air: float, fixed: float, kappa: float, first: float
) -> float:
    """Absolute pressure at which air and a volume that depends on it agree [Pa].

    By Newton's method, kept between pressures that are too low and too high: a volume that grows or
    hardly shrinks with pressure leaves one solution.

    Args:
        m: parameters.
        air: air state y.
        fixed: volume that does not depend on the pressure [m^3].
        kappa: contraction [-].
        first: pressure that the search begins with [Pa].
    """
    low, high, index = m.chamber.floor, math.inf, m.chamber.polytropic_index
    pressure, before = first, math.inf
    for _ in range(100):
        gained, slope = volume_and_slope(m, kappa, pressure - m.chamber.atmosphere)
        inside = fixed + gained
        if not inside > 0.0:
            return math.nan
        wanted = absolute_pressure(air, inside, index, m.chamber.floor)
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
