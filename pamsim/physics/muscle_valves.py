"""Valves of a muscle: from a command to their opening, and from that to the flow of air.

Every function takes the parameter row ``par`` and the states ``act`` of one actuator in the layout
of `pamsim.physics.layout`.
"""

from __future__ import annotations

from pamsim.core.units import PA_PER_BAR
from pamsim.physics.air import GAS_CONSTANT
from pamsim.physics.chamber_pressure import chamber_pressure
from pamsim.physics.commands import MEASURED, PRESSURE_SET, PULSE, VALVE
from pamsim.physics.laminar_gap import laminar_flow
from pamsim.physics.layout import LINE, OPENING, SAG, TUBE, MutableRow, Row, slot
from pamsim.physics.orifice import mass_flow
from pamsim.physics.supply import Valves, supply_sag
from pamsim.physics.valves import (
    clamped_opening,
    line_rate,
    past_dead_zone,
    pulsed_opening,
    regulated_opening,
    slewed_opening,
    valve_flow,
)

_COMMAND = slot("command")
_TEMPERATURE = slot("chamber.temperature")
_ATMOSPHERE = slot("chamber.atmosphere")
_LEAK = slot("chamber.leak_conductance")
_LAMINAR_LEAK = slot("chamber.laminar_leak_conductance")
_FILL = slot("valve.conductance_fill")
_EXHAUST = slot("valve.conductance_exhaust")
_CRITICAL = slot("valve.critical_ratio")
_LAMINAR = slot("valve.laminar_ratio")
_SUPPLY = slot("valve.supply_pressure")
_RESISTANCE = slot("valve.supply_resistance")
_SQUARE = slot("valve.supply_square")
_SUPPLY_VOLUME = slot("valve.supply_volume")
_LINE_LAG, _LINE_SLEW_TIME = slot("valve.line_lag"), slot("valve.line_slew_time")
_PULSE_PERIOD = slot("valve.pulse_period")
_BAND = slot("valve.regulator_band")
_DEAD_BAND = slot("valve.regulator_dead_band")
_DEAD_ZONE = slot("valve.dead_zone")
_DEAD_ZONE_ASYMMETRY = slot("valve.dead_zone_asymmetry")
_TRAVEL_TIME = slot("valve.travel_time")
_TUBE_RESISTANCE = slot("valve.tube_resistance")

SENSOR_ERROR = 0.01
"""Share of the supply's pressure by which a measured pressure may read above it."""


def asks_too_much(par: Row, command: float) -> bool:
    """Whether a command is a set point above the supply's pressure, errors of sensors apart.

    Args:
        par: parameter row.
        command: signed opening, signed duty or gauge pressure [Pa], as the row specifies.
    """
    return par[_COMMAND] == PRESSURE_SET and command > (1.0 + SENSOR_ERROR) * par[_SUPPLY]


def wanted_opening(par: Row, command: float, pressure: float, time: float) -> float:
    """Signed opening in [-1, 1] to which a command moves the valve pair, dead zone included.

    Args:
        par: parameter row.
        command: signed opening, signed duty or gauge pressure [Pa], as the row specifies.
        pressure: gauge pressure at the valves [Pa].
        time: [s].
    """
    if par[_COMMAND] == VALVE:
        return clamped_opening(command)
    if par[_COMMAND] == PULSE:
        return pulsed_opening(command, time, par[_PULSE_PERIOD])
    if par[_COMMAND] == MEASURED:
        return 0.0
    return regulated_opening(command, pressure, par[_BAND], par[_DEAD_BAND])


def valve_opening(par: Row, command: float, pressure: float, time: float) -> float:
    """Signed opening of the valve pair that a command means, dead zone passed, in [-1, 1].

    Args:
        par: parameter row.
        command: signed opening, signed duty or gauge pressure [Pa], as the row specifies.
        pressure: gauge pressure at the valves [Pa].
        time: [s].
    """
    return left_by_dead_zone(par, wanted_opening(par, command, pressure, time))


def left_by_dead_zone(par: Row, opening: float) -> float:
    """Signed opening that the dead zone leaves of one, in [-1, 1]."""
    if par[_DEAD_ZONE] == 0.0:
        return opening
    return past_dead_zone(opening, par[_DEAD_ZONE], par[_DEAD_ZONE_ASYMMETRY])


def reached_opening(
    par: Row, act: Row, command: float, pressure: float, time: float, timestep: float
) -> float:
    """Opening [-] reached in a time step, dead zone included; see `wanted_opening`."""
    wanted = wanted_opening(par, command, pressure, time)
    if par[_TRAVEL_TIME] == 0.0:
        return wanted
    return slewed_opening(wanted, act[len(act) - OPENING], par[_TRAVEL_TIME], timestep)


def lags(par: Row) -> bool:
    """Whether the command's line follows with a lag or at a limited rate."""
    return par[_LINE_LAG] + par[_LINE_SLEW_TIME] > 0.0


def command_at_valve(par: Row, act: Row, command: float) -> float:
    """The command behind its line; any unit."""
    if lags(par):
        return act[len(act) - LINE]
    return command


def line_change(par: Row, command: float, carried: float, timestep: float) -> float:
    """Rate of the command on its line, see `line_rate`; any unit per second.

    A limited rate refers to 1 bar of a set point or to a full opening.

    Args:
        par: parameter row.
        command: as sent.
        carried: at the line's other end.
        timestep: [s].
    """
    sent, full = command, PA_PER_BAR
    if par[_COMMAND] != PRESSURE_SET:
        sent, full = clamped_opening(command), 1.0
    return line_rate(sent, carried, par[_LINE_LAG], par[_LINE_SLEW_TIME], full, timestep)


def pressure_at_valve(par: Row, act: Row, tendon_length: float) -> float:
    """Absolute pressure at the valves [Pa]: the chamber's, or that at the near end of a tube."""
    if par[_TUBE_RESISTANCE] > 0.0 and par[_COMMAND] != MEASURED:
        return act[len(act) - TUBE]
    return chamber_pressure(par, act, tendon_length)


def sensed_pressure(par: Row, act: Row, tendon_length: float) -> float:
    """Gauge pressure that a sensor at the valves sees [Pa]."""
    return pressure_at_valve(par, act, tendon_length) - par[_ATMOSPHERE]


def fill_valve(par: Row, pressure_abs: float, opening: float, valve: MutableRow) -> None:
    """Write what a muscle's fill valve means to its supply.

    Args:
        par: parameter row.
        pressure_abs: absolute pressure behind it [Pa].
        opening: signed, of the pair, dead zone passed.
        valve: (VALVE,) written, see `pamsim.physics.supply.supply_sag`.
    """
    valve[0] = par[_SUPPLY] + par[_ATMOSPHERE]
    valve[1] = pressure_abs
    valve[2] = 0.0 if opening <= 0.0 else opening * par[_FILL]
    valve[3] = par[_CRITICAL]
    valve[4] = par[_LAMINAR]
    valve[5] = par[_TEMPERATURE]


def fill_valve_of(
    par: Row,
    act: Row,
    tendon_length: float,
    command: float,
    time: float,
    timestep: float,
    valve: MutableRow,
) -> None:
    """Write what the fill valve of a muscle in a given state means to its supply.

    Args:
        par: parameter row.
        act: states.
        tendon_length: [m].
        command: as sent, before the lag of its line.
        time: [s].
        timestep: [s].
        valve: (VALVE,) written.
    """
    pressure_abs = pressure_at_valve(par, act, tendon_length)
    gauge = pressure_abs - par[_ATMOSPHERE]
    sent = command_at_valve(par, act, command)
    opening = reached_opening(par, act, sent, gauge, time, timestep)
    fill_valve(par, pressure_abs, left_by_dead_zone(par, opening), valve)


def sags(par: Row) -> bool:
    """Whether the supply's pressure falls with the flow drawn from it."""
    return par[_RESISTANCE] + par[_SQUARE] > 0.0


def line_sag(par: Row, act: Row, valves: Valves, timestep: float) -> float:
    """Fall of a muscle's supply during a time step [Pa].

    Args:
        par: parameter row of the muscle.
        act: its states.
        valves: (m, VALVE) fill valves of all muscles on its supply, see `fill_valve`.
        timestep: [s].
    """
    full = par[_SUPPLY] + par[_ATMOSPHERE]
    storage = par[_SUPPLY_VOLUME] / (GAS_CONSTANT * par[_TEMPERATURE] * timestep)
    before = full * act[len(act) - SAG]
    return supply_sag(valves, par[_RESISTANCE], par[_SQUARE], storage, before)


def air_flow(par: Row, pressure_abs: float, command: float, time: float, sag: float = 0.0) -> float:
    """Mass flow into a chamber right behind quick valves [kg/s], minus the leak.

    Args:
        par: parameter row.
        pressure_abs: absolute pressure in the chamber [Pa].
        command: see `valve_opening`.
        time: [s].
        sag: fall of the supply's pressure [Pa].
    """
    opening = valve_opening(par, command, pressure_abs - par[_ATMOSPHERE], time)
    return flow_through_valves(par, pressure_abs, opening, sag) - leak_flow(par, pressure_abs)


def flow_through_valves(par: Row, pressure_abs: float, opening: float, sag: float) -> float:
    """Mass flow through the valves [kg/s].

    Args:
        par: parameter row.
        pressure_abs: absolute pressure behind them [Pa].
        opening: signed, dead zone passed, in [-1, 1].
        sag: fall of the supply's pressure [Pa].
    """
    return valve_flow(
        opening,
        pressure_abs,
        par[_SUPPLY] + par[_ATMOSPHERE] - sag,
        par[_ATMOSPHERE],
        par[_FILL],
        par[_EXHAUST],
        par[_CRITICAL],
        par[_LAMINAR],
        par[_TEMPERATURE],
    )


def leak_flow(par: Row, pressure_abs: float) -> float:
    """Mass flow out of the chamber through its leaks, orifice and narrow gap [kg/s]."""
    lost = 0.0
    if par[_LEAK] > 0.0:
        lost += mass_flow(
            pressure_abs,
            par[_ATMOSPHERE],
            par[_LEAK],
            par[_CRITICAL],
            par[_LAMINAR],
            par[_TEMPERATURE],
        )
    if par[_LAMINAR_LEAK] > 0.0:
        lost += laminar_flow(pressure_abs, par[_ATMOSPHERE], par[_LAMINAR_LEAK], par[_TEMPERATURE])
    return lost
