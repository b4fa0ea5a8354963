"""Pressure in a muscle's chamber, from its air and the volume at its length.

Every function takes the parameter row ``par`` and the states ``act`` of one actuator in the layout
of `pamsim.physics.layout`.
"""

from __future__ import annotations

import math

from pamsim.physics.chamber import absolute_pressure
from pamsim.physics.commands import MEASURED
from pamsim.physics.layout import AIR, EARLIER, LAST, Row, slot
from pamsim.physics.muscle_hysteresis import hysteresis_volume
from pamsim.physics.muscle_length import length_at_muscle
from pamsim.physics.static_muscle import (
    contraction,
    rigid_volume,
    static_volume,
    volume_and_slope,
    volume_at_nominal_length,
    volume_varies,
)

_COMMAND = slot("command")
_POLYTROPIC = slot("chamber.polytropic_index")
_ATMOSPHERE = slot("chamber.atmosphere")
_FLOOR = slot("chamber.floor")
_TYPICAL_PRESSURE = 3e5  # gauge [Pa]: where a volume that depends on it is taken to begin with
_CLOSE = 3e-6  # relative step that may be the last of the pressure search
_LEFT = 1e-11  # and relative error that it may leave, if the next step shrinks as it did


def chamber_volume(par: Row, act: Row, tendon_length: float, pressure: float) -> float:
    """Volume of the air [m^3], hysteresis included.

    Args:
        par: parameter row.
        act: states.
        tendon_length: at the muscle [m].
        pressure: gauge pressure [Pa], see `static_volume`.
    """
    kappa = contraction(par, tendon_length)
    return static_volume(par, tendon_length, pressure) + hysteresis_volume(par, act, kappa)


def chamber_pressure(par: Row, act: Row, tendon_length: float) -> float:
    """Absolute pressure in the chamber [Pa].

    A chamber without air is one whose state was never set (a bare ``mj_resetData`` zeroes it), one
    without volume is stretched beyond its fibres: both give NaN, so that the run stops there and
    not at a plausible wrong number. A measured pressure is the state itself.
    """
    if par[_COMMAND] == MEASURED:
        imposed = act[len(act) - AIR]
        return imposed if imposed > 0.0 else math.nan
    length = length_at_muscle(par, act, tendon_length)
    kappa = contraction(par, length)
    fixed = volume_at_nominal_length(par) + hysteresis_volume(par, act, kappa)
    air = act[len(act) - AIR]
    if not air > 0.0:
        return math.nan
    if volume_varies(par):
        first = _search_start(par, act, fixed, kappa)
        return _consistent_pressure(par, air, fixed, kappa, first)
    inside = fixed + rigid_volume(par, kappa, _TYPICAL_PRESSURE)
    if not inside > 0.0:
        return math.nan
    return absolute_pressure(air, inside, par[_POLYTROPIC], par[_FLOOR])


def _search_start(par: Row, act: Row, fixed: float, kappa: float) -> float:
    """Absolute pressure with which the search for it begins [Pa].

    Going on as in the last two steps leaves so little that the search mostly ends where it begins.
    Without a step before, it is the pressure that a braid of typical length would have.

    Args:
        par: parameter row.
        act: states.
        fixed: volume that does not depend on the pressure [m^3].
        kappa: contraction [-].
    """
    last = act[len(act) - LAST]
    if last > 0.0:
        going_on = 2.0 * last - act[len(act) - EARLIER]
        return going_on if 0.5 * last < going_on < 2.0 * last else last
    inside = fixed + rigid_volume(par, kappa, _TYPICAL_PRESSURE)
    if inside > 0.0:
        return absolute_pressure(act[len(act) - AIR], inside, par[_POLYTROPIC], par[_FLOOR])
    return _TYPICAL_PRESSURE + par[_ATMOSPHERE]


def _consistent_pressure(par: Row, air: float, fixed: float, kappa: float, first: float) -> float:
    """Absolute pressure at which air and a volume that depends on it agree [Pa].

    By Newton's method, kept between pressures that are too low and too high: a volume that grows or
    hardly shrinks with pressure leaves one solution.

    Args:
        par: parameter row.
        air: air state y.
        fixed: volume that does not depend on the pressure [m^3].
        kappa: contraction [-].
        first: pressure that the search begins with [Pa].
    """
    low, high, index = par[_FLOOR], math.inf, par[_POLYTROPIC]
    pressure, before = first, math.inf
    for _ in range(100):
        gained, slope = volume_and_slope(par, kappa, pressure - par[_ATMOSPHERE])
        inside = fixed + gained
        if not inside > 0.0:
            return math.nan
        wanted = absolute_pressure(air, inside, index, par[_FLOOR])
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


def gauge_pressure(par: Row, act: Row, tendon_length: float) -> float:
    """Gauge pressure in the chamber [Pa]."""
    return chamber_pressure(par, act, tendon_length) - par[_ATMOSPHERE]
