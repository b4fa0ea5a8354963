"""Air of a muscle: from a command to the opening of its valves, and on to the flow.

``m`` are the parameters of one actuator, ``s`` its states and ``z`` its memory of hysteresis, see
`pamsim.physics.record`. A command is a signed opening, a signed duty or a gauge pressure [Pa], as
the row specifies; ``pressure_abs`` is an absolute pressure [Pa], and times are in seconds.
"""

from __future__ import annotations

import math

from pamsim.core.units import PA_PER_BAR
from pamsim.physics.air import GAS_CONSTANT, mass_flow
from pamsim.physics.chamber_pressure import chamber_pressure
from pamsim.physics.hysteresis.maxwell_slip import play
from pamsim.physics.record import Parameters, Row, States
from pamsim.physics.valves import (
    MEASURED,
    PRESSURE_SET,
    PULSE,
    VALVE,
    clamped_opening,
    flow_share,
    has_tube,
    past_dead_zone,
)

SENSOR_ERROR = 0.01
"""Share of the supply's pressure by which a measured pressure may read above it."""


def asks_too_much(m: Parameters, command: float) -> bool:
    """Whether a command is a set point above the supply's pressure, errors of sensors apart."""
    return m.command == PRESSURE_SET and command > (1.0 + SENSOR_ERROR) * m.valve.supply_pressure


def wanted_opening(
    m: Parameters, command: float, pressure: float, time: float, timestep: float = 0.0
) -> float:
    """Signed opening in [-1, 1] to which a command moves the valve pair, dead zone included.

    On/off valves that pulse are open during the first part of each period, which begin at time 0;
    over a time step it is the mean, so that no duty is rounded to whole steps. The regulator is
    proportional beyond its dead band, and keeps to its least set point where a lower one is sent.
    The command is the one behind its line, the pressure the gauge pressure at the valves [Pa].
    """
    if m.command == VALVE:
        return clamped_opening(command)
    if m.command == MEASURED:
        return 0.0
    # A NaN must not shut the valves silently, so that what is shut is not a plain 0.
    if m.command == PULSE:
        begin, width = time / m.valve.pulse_period, timestep / m.valve.pulse_period
        begin -= math.floor(begin)
        duty = abs(clamped_opening(command))
        if width > 0.0:
            opened = _open_periods(begin + width, duty) - _open_periods(begin, duty)
            return math.copysign(opened / width, command)
        return math.copysign(1.0, command) if begin < duty else 0.0 * command
    if command < m.valve.least_set_point and m.valve.least_set_point > 0.0:
        command = m.valve.least_set_point
    error = command - pressure
    beyond = abs(error) - m.valve.regulator_dead_band
    if beyond > 0.0:
        return clamped_opening(math.copysign(beyond / m.valve.regulator_band, error))
    return 0.0 * error


def _open_periods(periods: float, duty: float) -> float:
    """How long valves that pulse at a duty have been open after some periods, in periods."""
    whole = math.floor(periods)
    return whole * duty + min(periods - whole, duty)


def valve_opening(
    m: Parameters, command: float, pressure: float, time: float, timestep: float = 0.0
) -> float:
    """Signed opening that a command means, dead zone passed [-]; see `wanted_opening`."""
    return past_dead_zone(m.valve, wanted_opening(m, command, pressure, time, timestep))


def _has_line(m: Parameters) -> bool:
    return m.valve.line_lag + m.valve.line_slew_time > 0.0


def reached_opening(
    m: Parameters, s: States, command: float, pressure_abs: float, time: float, timestep: float
) -> float:
    """Signed opening in [-1, 1] that valves of limited speed reach in a step, dead zone included.

    Proportional valves stick at a reversal: they follow the command through the play operator of
    half the hysteresis; those that pulse snap from end to end. The command is the one sent, before
    its line, whose end reaches the valves as it is at the end of the step: a line without lag is
    none. The pressure is that at the valves.
    """
    at_valve = command
    if _has_line(m):
        at_valve = s.line + timestep * line_rate(m, s, command, timestep)
    wanted = wanted_opening(m, at_valve, pressure_abs - m.chamber.atmosphere, time, timestep)
    if m.valve.hysteresis > 0.0 and m.command != PULSE:
        wanted = play(wanted, s.opening, 0.5 * m.valve.hysteresis)
    way = wanted - s.opening
    if abs(way) * m.valve.travel_time > timestep:
        return s.opening + math.copysign(timestep / m.valve.travel_time, way)
    return wanted


def line_rate(m: Parameters, s: States, command: float, timestep: float) -> float:
    """Rate of a command on a line with a first-order lag and a limited rate [command per s].

    The limit refers to 1 bar of a set point or to a full opening. Below it an Euler step takes the
    line to where it is exactly. 0 without a line; NaN stays NaN.
    """
    if not _has_line(m):
        return 0.0
    sent, full, share = command, PA_PER_BAR, 1.0
    if m.command != PRESSURE_SET:
        sent, full = clamped_opening(command), 1.0
    if m.valve.line_lag > 0.0:
        share = -math.expm1(-timestep / m.valve.line_lag)
    rate = (sent - s.line) * share / timestep
    if abs(rate) * m.valve.line_slew_time > full:
        return math.copysign(full / m.valve.line_slew_time, rate)
    return rate


def pressure_at_valve(m: Parameters, s: States, pressure_abs: float) -> float:
    """Absolute pressure at the valves [Pa]: the chamber's, or that at the near end of a tube."""
    if has_tube(m.valve) and m.command != MEASURED and s.tube_pressure != 0.0:
        return s.tube_pressure
    return pressure_abs


def sensed_pressure(m: Parameters, s: States, z: Row, tendon_length: float) -> float:
    """Gauge pressure that a sensor at the valves sees [Pa]."""
    pressure_abs = chamber_pressure(m, s, z, tendon_length)
    return pressure_at_valve(m, s, pressure_abs) - m.chamber.atmosphere


def flow_through_valves(m: Parameters, pressure_abs: float, opening: float, sag: float) -> float:
    """Mass flow through the pair of valves, positive towards the muscle (ISO 6358) [kg/s].

    The opening is signed, dead zone included; the sag is the fall of the supply's pressure [Pa].
    """
    left = flow_share(m.valve, opening)
    source, conductance = m.chamber.atmosphere, -left * m.valve.conductance_exhaust
    if left > 0.0:
        source = m.valve.supply_pressure + m.chamber.atmosphere - sag
        conductance = left * m.valve.conductance_fill
    ratio, linear = m.valve.critical_ratio, m.valve.laminar_ratio
    return mass_flow(source, pressure_abs, conductance, ratio, linear, m.chamber.temperature)


def leak_flow(m: Parameters, pressure_abs: float) -> float:
    """Mass flow out of the chamber through its leaks, orifice and narrow gap [kg/s].

    In the gap the volume flow is g (p1 - p2) (Poiseuille; g = pi r^4 / (8 eta l) for a capillary)
    and the density counts with its mean: mdot = g (p1^2 - p2^2) / (2 R_air T), as in EN 1779.
    """
    outside, temperature = m.chamber.atmosphere, m.chamber.temperature
    mean_density = 0.5 * (pressure_abs + outside) / (GAS_CONSTANT * temperature)
    lost = m.chamber.laminar_leak_conductance * mean_density * (pressure_abs - outside)
    size = m.chamber.leak_conductance
    if size > 0.0:
        ratio, linear = m.valve.critical_ratio, m.valve.laminar_ratio
        lost += mass_flow(pressure_abs, outside, size, ratio, linear, temperature)
    return lost


def cross_flow(m: Parameters, other: Parameters, pressure_abs: float, beyond_abs: float) -> float:
    """Mass flow that leaks into a chamber from that of the muscle at the chain's other end [kg/s].

    Through a narrow gap as in `leak_flow`, with the mean of what both muscles state, so that one
    loses what the other gains. Of the absolute pressures in both [Pa].
    """
    size = 0.5 * (m.chamber.cross_leak_conductance + other.chamber.cross_leak_conductance)
    temperature = 0.5 * (m.chamber.temperature + other.chamber.temperature)
    mean_density = 0.5 * (pressure_abs + beyond_abs) / (GAS_CONSTANT * temperature)
    return size * mean_density * (beyond_abs - pressure_abs)


def _flow_along(laminar: float, turbulent: float, difference: float) -> float:
    """Flow v along a line [kg/s] that loses a difference of pressure R v + k v |v| [Pa]."""
    steepness = laminar + math.sqrt(laminar * laminar + 4.0 * turbulent * abs(difference))
    if steepness > 0.0:
        return 2.0 * difference / steepness
    return 0.0 * difference  # not a plain 0: a NaN must not stop the flow silently


def tube_step(
    m: Parameters, before: float, pressure_abs: float, inflow: float, timestep: float
) -> tuple[float, float]:
    """Absolute pressure at the tube's near end after a time step [Pa], and mean flow out [kg/s].

    The tube is a small volume V of air at constant temperature T, then a line through which v goes
    on into the muscle, with a laminar resistance R, at a mean density that varies little, and
    turbulent friction K at the density rho of the mean pressure:

        V / (R_air T) dp/dt = w - v,    p - P = R v + K v |v| / rho

    For constant w and P the pressure tends to that at which v = w. It does so by an exponential of
    the slope between both flows, which the laminar step has exactly: little volume needs no short
    step, and no step overshoots. Of p before the step, P in the muscle [Pa, absolute] and the
    inflow w from the valves [kg/s].
    """
    per_mass = GAS_CONSTANT * m.chamber.temperature
    laminar = m.valve.tube_resistance
    turbulent = m.valve.tube_friction * per_mass / (0.5 * (before + pressure_abs))
    level = pressure_abs + (laminar + turbulent * abs(inflow)) * inflow
    outflow = _flow_along(laminar, turbulent, before - pressure_abs)
    flows = abs(outflow) + abs(inflow)
    if outflow * inflow < 0.0:
        flows = (outflow * outflow + inflow * inflow) / flows
    emptying = (laminar + turbulent * flows) * m.valve.tube_volume / per_mass
    after = level
    if emptying > 0.0:
        after = before + (level - before) * -math.expm1(-timestep / emptying)
    # No air is lost: the rest of the inflow stays in the tube.
    return after, inflow - m.valve.tube_volume * (after - before) / (per_mass * timestep)
