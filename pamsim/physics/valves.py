"""A pair of valves per muscle, one to supply and one to exhaust, and three ways to drive it.

The pair is driven by a signed opening u in [-1, 1]: +1 fully open to supply, -1 fully open to
exhaust, 0 shut. The command is that opening itself, a duty that pulses on/off valves, or a pressure
set point that a local regulator turns into an opening.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from pamsim.core.parameters import ParameterGroup, parameter
from pamsim.physics.orifice import mass_flow

_WIDEST_DEAD_ZONE = 0.9


@dataclass(frozen=True, kw_only=True)
class ValvePair(ParameterGroup):
    """Fill and exhaust valve of one muscle, with the supply behind them."""

    group: ClassVar[str] = "valve"
    conductance_fill: float = parameter(
        unit="m^3/(s*Pa)", low=0.0, high=1e-6, doc="sonic conductance C to the supply"
    )
    conductance_exhaust: float = parameter(
        unit="m^3/(s*Pa)", low=0.0, high=1e-6, doc="sonic conductance C to the exhaust"
    )
    critical_ratio: float = parameter(unit="1", low=0.0, high=0.9, doc="critical pressure ratio b")
    laminar_ratio: float = parameter(
        unit="1", low=0.95, high=0.9999, doc="ratio above which flow is linear", default=0.999
    )
    supply_pressure: float = parameter(
        unit="Pa", low=0.0, high=2e6, doc="gauge pressure of the supply"
    )
    pulse_period: float = parameter(
        unit="s", low=1e-4, high=1.0, doc="period of pulse-width modulation", default=0.02
    )
    regulator_band: float = parameter(
        unit="Pa",
        low=1.0,
        high=1e6,
        doc="pressure error at which the set-point regulator opens a valve fully",
        default=1e4,
    )
    regulator_dead_band: float = parameter(
        unit="Pa", low=0.0, high=1e5, doc="error the regulator leaves alone", default=0.0
    )
    dead_zone: float = parameter(
        unit="1",
        low=0.0,
        high=_WIDEST_DEAD_ZONE,
        doc="opening up to which a valve stays shut, mean of both",
        default=0.0,
    )
    dead_zone_asymmetry: float = parameter(
        unit="1",
        low=-1.0,
        high=1.0,
        doc="a: fill valve shut up to 1 + a times the dead zone, exhaust valve up to 1 - a times",
        default=0.0,
    )
    supply_resistance: float = parameter(
        unit="Pa*s/kg",
        low=0.0,
        high=1e11,
        doc="fall of the supply's pressure per mass flow drawn by all its muscles",
        default=0.0,
    )
    supply_square: float = parameter(
        unit="Pa*s^2/kg^2",
        low=0.0,
        high=1e16,
        doc="fall of the supply's pressure per square of that flow, as in fittings and regulators",
        default=0.0,
    )
    supply_volume: float = parameter(
        unit="m^3",
        low=0.0,
        high=1.0,
        doc="volume of air between the supply's resistance and the valves",
        default=0.0,
    )
    supply_line: float = parameter(
        unit="1",
        low=0.0,
        high=1e3,
        doc="number of the supply: muscles that state the same one share it",
        default=0.0,
    )
    line_lag: float = parameter(
        unit="s", low=0.0, high=10.0, doc="time constant from command to valve", default=0.0
    )
    line_slew_time: float = parameter(
        unit="s",
        low=0.0,
        high=10.0,
        doc="in which the command's line moves by 1 bar or a full opening at its limited rate",
        default=0.0,
    )
    travel_time: float = parameter(
        unit="s",
        low=0.0,
        high=10.0,
        doc="in which a valve goes from shut to fully open at its limited speed",
        default=0.0,
    )
    tube_resistance: float = parameter(
        unit="Pa*s/kg",
        low=0.0,
        high=1e11,
        doc="R, pressure difference per mass flow along the line from valves and sensor to muscle",
        default=0.0,
    )
    tube_volume: float = parameter(
        unit="m^3",
        low=1e-6,
        high=1e-2,
        doc="V of the tube at the valves, in addition to the dead volume; limits the time step",
        default=5e-6,
    )
    delay: float = parameter(
        unit="s", low=0.0, high=1.0, doc="dead time of the command; in simulate only", default=0.0
    )


def clamped_opening(command: float) -> float:
    """Limit a signed opening to [-1, 1]; the engine hands plugins the raw control.

    Args:
        command: wanted opening [-].

    Returns:
        Opening in [-1, 1]; NaN stays NaN.
    """
    if command > 1.0:
        return 1.0
    if command < -1.0:
        return -1.0
    return command


def pulsed_opening(duty: float, time: float, period: float) -> float:
    """Opening of on/off valves driven by pulse-width modulation.

    Args:
        duty: signed duty in [-1, 1]; its sign selects the valve, its size the share of the period.
        time: [s], from the start of the first period.
        period: [s].

    Returns:
        -1, 0 or 1: the valve is open during the first part of each period.
    """
    phase = time / period - math.floor(time / period)
    if phase < abs(duty):
        return 1.0 if duty > 0.0 else -1.0
    return 0.0 * duty  # not a plain 0: a NaN duty must not shut the valve silently


def regulated_opening(set_point: float, pressure: float, band: float, dead_band: float) -> float:
    """Opening that a proportional pressure regulator gives; a small band resembles on/off valves.

    Args:
        set_point: wanted gauge pressure [Pa].
        pressure: gauge pressure [Pa].
        band: error beyond the dead band at which a valve is fully open [Pa].
        dead_band: error below which both valves stay shut [Pa].

    Returns:
        Opening in [-1, 1].
    """
    error = set_point - pressure
    if error > dead_band:
        return clamped_opening((error - dead_band) / band)
    if error < -dead_band:
        return clamped_opening((error + dead_band) / band)
    return 0.0 * error  # not a plain 0: a NaN error must not shut the valve silently


def line_rate(
    command: float, carried: float, lag: float, slew_time: float, full: float, timestep: float
) -> float:
    """Rate of a command on a line with a first-order lag and a limited rate, over an Euler step.

    Args:
        command: at the line's one end, held during the step [any unit].
        carried: at its other end, in the same unit.
        lag: time constant [s]; 0 for none.
        slew_time: in which the line moves by ``full`` at most [s]; 0 for no limit.
        full: that the limit refers to, in the same unit.
        timestep: [s].

    Returns:
        Rate, in that unit per second; without a limit it takes ``carried`` in one step to where it
        is exactly. NaN stays NaN.
    """
    share = 1.0
    if lag > 0.0:
        share = -math.expm1(-timestep / lag)
    rate = (command - carried) * share / timestep
    if abs(rate) * slew_time > full:
        return math.copysign(full / slew_time, rate)
    return rate


def slewed_opening(opening: float, before: float, travel_time: float, timestep: float) -> float:
    """Opening that a valve of limited speed reaches in a time step.

    Args:
        opening: wanted, in [-1, 1].
        before: at the start of the step.
        travel_time: from shut to fully open [s]; 0 for a valve that is there at once.
        timestep: [s].

    Returns:
        Opening in [-1, 1], no further from ``before`` than the valve moves; NaN stays NaN.
    """
    if abs(opening - before) * travel_time > timestep:
        return before + math.copysign(timestep / travel_time, opening - before)
    return opening


def own_dead_zone(dead_zone: float, share: float) -> float:
    """Opening up to which one of the two valves stays shut, in [0, 0.9].

    Args:
        dead_zone: mean of both, in [0, 0.9].
        share: of it that this valve has: 1 + a of the fill valve, 1 - a of the exhaust valve.
    """
    return min(dead_zone * share, _WIDEST_DEAD_ZONE)


def past_dead_zone(opening: float, dead_zone: float, asymmetry: float) -> float:
    """What is left of a signed opening behind the overlap that shuts a valve around zero.

    The rest is stretched to the full range: the flow sets in without a jump, on which a regulator
    would chatter, and the conductance stays that of the fully open valve. On/off valves, which open
    fully or not at all, do not notice.

    Args:
        opening: in [-1, 1].
        dead_zone: opening up to which the valves stay shut, mean of both; 0 for none, exactly.
        asymmetry: a, see `own_dead_zone`; 0 for the same zone on both sides, exactly.

    Returns:
        Opening in [-1, 1].
    """
    fill = own_dead_zone(dead_zone, 1.0 + asymmetry)
    if opening > fill:
        return (opening - fill) / (1.0 - fill)
    exhaust = own_dead_zone(dead_zone, 1.0 - asymmetry)
    if opening < -exhaust:
        return (opening + exhaust) / (1.0 - exhaust)
    return 0.0 * opening  # not a plain 0: a NaN opening must not shut the valve silently


def valve_flow(
    opening: float,
    chamber_abs: float,
    supply_abs: float,
    exhaust_abs: float,
    conductance_fill: float,
    conductance_exhaust: float,
    critical_ratio: float,
    laminar_ratio: float,
    temperature: float,
) -> float:
    """Mass flow into the chamber through the pair of valves (ISO 6358).

    Args:
        opening: signed opening in [-1, 1].
        chamber_abs: absolute pressure in the chamber [Pa].
        supply_abs: absolute supply pressure [Pa].
        exhaust_abs: absolute pressure at the exhaust [Pa].
        conductance_fill: C of the fill valve, fully open [m^3/(s Pa)].
        conductance_exhaust: C of the exhaust valve, fully open [m^3/(s Pa)].
        critical_ratio: b [-].
        laminar_ratio: see `pamsim.physics.orifice.flow_function`.
        temperature: of the air [K].

    Returns:
        mdot [kg/s], positive into the chamber.
    """
    if opening > 0.0:
        return mass_flow(
            supply_abs,
            chamber_abs,
            opening * conductance_fill,
            critical_ratio,
            laminar_ratio,
            temperature,
        )
    return -mass_flow(
        chamber_abs,
        exhaust_abs,
        -opening * conductance_exhaust,
        critical_ratio,
        laminar_ratio,
        temperature,
    )
