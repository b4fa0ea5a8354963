"""Valves of a muscle: from a command to their opening, and from that to the flow of air.

``m`` are the parameters of one actuator, ``s`` its states and ``z`` its memory of hysteresis, see
`pamsim.physics.record`.
"""

from __future__ import annotations

from pamsim.core.units import PA_PER_BAR
from pamsim.physics.air import GAS_CONSTANT
from pamsim.physics.chamber_pressure import chamber_pressure
from pamsim.physics.commands import MEASURED, PRESSURE_SET, PULSE, VALVE
from pamsim.physics.laminar_gap import laminar_flow
from pamsim.physics.orifice import mass_flow
from pamsim.physics.record import MutableRow, Parameters, Row, States
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

SENSOR_ERROR = 0.01
"""Share of the supply's pressure by which a measured pressure may read above it."""


def asks_too_much(m: Parameters, command: float) -> bool:
    """Whether a command is a set point above the supply's pressure, errors of sensors apart.

    Args:
        m: parameters.
        command: signed opening, signed duty or gauge pressure [Pa], as the row specifies.
    """
    return m.command == PRESSURE_SET and command > (1.0 + SENSOR_ERROR) * m.valve.supply_pressure


def wanted_opening(m: Parameters, command: float, pressure: float, time: float) -> float:
    """Signed opening in [-1, 1] to which a command moves the valve pair, dead zone included.

    Args:
        m: parameters.
        command: signed opening, signed duty or gauge pressure [Pa], as the row specifies.
        pressure: gauge pressure at the valves [Pa].
        time: [s].
    """
    if m.command == VALVE:
        return clamped_opening(command)
    if m.command == PULSE:
        return pulsed_opening(command, time, m.valve.pulse_period)
    if m.command == MEASURED:
        return 0.0
    return regulated_opening(command, pressure, m.valve.regulator_band, m.valve.regulator_dead_band)


def valve_opening(m: Parameters, command: float, pressure: float, time: float) -> float:
    """Signed opening of the valve pair that a command means, dead zone passed, in [-1, 1].

    Args:
        m: parameters.
        command: signed opening, signed duty or gauge pressure [Pa], as the row specifies.
        pressure: gauge pressure at the valves [Pa].
        time: [s].
    """
    return left_by_dead_zone(m, wanted_opening(m, command, pressure, time))


def left_by_dead_zone(m: Parameters, opening: float) -> float:
    """Signed opening that the dead zone leaves of one, in [-1, 1]."""
    if m.valve.dead_zone == 0.0:
        return opening
    return past_dead_zone(opening, m.valve.dead_zone, m.valve.dead_zone_asymmetry)


def reached_opening(
    m: Parameters, s: States, command: float, pressure: float, time: float, timestep: float
) -> float:
    """Opening [-] reached in a time step, dead zone included; see `wanted_opening`."""
    wanted = wanted_opening(m, command, pressure, time)
    if m.valve.travel_time == 0.0:
        return wanted
    return slewed_opening(wanted, s.opening, m.valve.travel_time, timestep)


def lags(m: Parameters) -> bool:
    """Whether the command's line follows with a lag or at a limited rate."""
    return m.valve.line_lag + m.valve.line_slew_time > 0.0


def command_at_valve(m: Parameters, s: States, command: float) -> float:
    """The command behind its line; any unit."""
    if lags(m):
        return s.line
    return command


def line_change(m: Parameters, command: float, carried: float, timestep: float) -> float:
    """Rate of the command on its line, see `line_rate`; any unit per second.

    A limited rate refers to 1 bar of a set point or to a full opening.

    Args:
        m: parameters.
        command: as sent.
        carried: at the line's other end.
        timestep: [s].
    """
    sent, full = command, PA_PER_BAR
    if m.command != PRESSURE_SET:
        sent, full = clamped_opening(command), 1.0
    return line_rate(sent, carried, m.valve.line_lag, m.valve.line_slew_time, full, timestep)


def pressure_at_valve(m: Parameters, s: States, pressure_abs: float) -> float:
    """Absolute pressure at the valves [Pa]: the chamber's, or that at the near end of a tube.

    Args:
        m: parameters.
        s: states.
        pressure_abs: in the chamber [Pa].
    """
    if m.valve.tube_resistance > 0.0 and m.command != MEASURED and s.tube_pressure != 0.0:
        return s.tube_pressure
    return pressure_abs


def sensed_pressure(m: Parameters, s: States, z: Row, tendon_length: float) -> float:
    """Gauge pressure that a sensor at the valves sees [Pa]."""
    pressure_abs = chamber_pressure(m, s, z, tendon_length)
    return pressure_at_valve(m, s, pressure_abs) - m.chamber.atmosphere


def fill_valve(m: Parameters, pressure_abs: float, opening: float, valve: MutableRow) -> None:
    """Write what a muscle's fill valve means to its supply.

    Args:
        m: parameters.
        pressure_abs: absolute pressure behind it [Pa].
        opening: signed, of the pair, dead zone passed.
        valve: (VALVE,) written, see `pamsim.physics.supply.supply_sag`.
    """
    valve[0] = m.valve.supply_pressure + m.chamber.atmosphere
    valve[1] = pressure_abs
    valve[2] = 0.0 if opening <= 0.0 else opening * m.valve.conductance_fill
    valve[3] = m.valve.critical_ratio
    valve[4] = m.valve.laminar_ratio
    valve[5] = m.chamber.temperature


def fill_valve_of(
    m: Parameters,
    s: States,
    pressure_abs: float,
    command: float,
    time: float,
    timestep: float,
    valve: MutableRow,
) -> None:
    """Write what the fill valve of a muscle in a given state means to its supply.

    Args:
        m: parameters.
        s: states.
        pressure_abs: in the chamber [Pa].
        command: as sent, before the lag of its line.
        time: [s].
        timestep: [s].
        valve: (VALVE,) written.
    """
    at_valve = pressure_at_valve(m, s, pressure_abs)
    sent = command_at_valve(m, s, command)
    opening = reached_opening(m, s, sent, at_valve - m.chamber.atmosphere, time, timestep)
    fill_valve(m, at_valve, left_by_dead_zone(m, opening), valve)


def sags(m: Parameters) -> bool:
    """Whether the supply's pressure falls with the flow drawn from it."""
    return m.valve.supply_resistance + m.valve.supply_square > 0.0


def line_sag(m: Parameters, s: States, valves: Valves, timestep: float) -> float:
    """Fall of a muscle's supply during a time step [Pa].

    Args:
        m: parameters of the muscle.
        s: its states.
        valves: (m, VALVE) fill valves of all muscles on its supply, see `fill_valve`.
        timestep: [s].
    """
    full = m.valve.supply_pressure + m.chamber.atmosphere
    storage = m.valve.supply_volume / (GAS_CONSTANT * m.chamber.temperature * timestep)
    before = full * s.sag
    return supply_sag(valves, m.valve.supply_resistance, m.valve.supply_square, storage, before)


def air_flow(
    m: Parameters, pressure_abs: float, command: float, time: float, sag: float = 0.0
) -> float:
    """Mass flow into a chamber right behind quick valves [kg/s], minus the leak.

    Args:
        m: parameters.
        pressure_abs: absolute pressure in the chamber [Pa].
        command: see `valve_opening`.
        time: [s].
        sag: fall of the supply's pressure [Pa].
    """
    opening = valve_opening(m, command, pressure_abs - m.chamber.atmosphere, time)
    return flow_through_valves(m, pressure_abs, opening, sag) - leak_flow(m, pressure_abs)


def flow_through_valves(m: Parameters, pressure_abs: float, opening: float, sag: float) -> float:
    """Mass flow through the valves [kg/s].

    Args:
        m: parameters.
        pressure_abs: absolute pressure behind them [Pa].
        opening: signed, dead zone passed, in [-1, 1].
        sag: fall of the supply's pressure [Pa].
    """
    return valve_flow(
        opening,
        pressure_abs,
        m.valve.supply_pressure + m.chamber.atmosphere - sag,
        m.chamber.atmosphere,
        m.valve.conductance_fill,
        m.valve.conductance_exhaust,
        m.valve.critical_ratio,
        m.valve.laminar_ratio,
        m.chamber.temperature,
    )


def leak_flow(m: Parameters, pressure_abs: float) -> float:
    """Mass flow out of the chamber through its leaks, orifice and narrow gap [kg/s]."""
    lost = 0.0
    if m.chamber.leak_conductance > 0.0:
        lost += mass_flow(
            pressure_abs,
            m.chamber.atmosphere,
            m.chamber.leak_conductance,
            m.valve.critical_ratio,
            m.valve.laminar_ratio,
            m.chamber.temperature,
        )
    if m.chamber.laminar_leak_conductance > 0.0:
        lost += laminar_flow(
            pressure_abs,
            m.chamber.atmosphere,
            m.chamber.laminar_leak_conductance,
            m.chamber.temperature,
        )
    return lost
