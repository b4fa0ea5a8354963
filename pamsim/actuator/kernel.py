"""The muscle actuator: the one composition of all laws, from parameters and state to force.

Every function takes the parameter row ``par`` and the states ``act`` of one actuator in the layout
of `pamsim.actuator.layout`. They are ordinary Python over anything that can be indexed, and the
engine compiles these same functions for the muscles' plugin. An effect at its neutral value leaves
the result unchanged to the last bit.
"""

from __future__ import annotations

import math

from pamsim.actuator.chain import extension_rate, rippled_ratio, rippled_travel, shift_rate
from pamsim.actuator.friction import dry_friction, stribeck_friction
from pamsim.actuator.layout import (
    AIR,
    AMBIENT,
    CREEP,
    CREEP_2,
    EARLIER,
    EXTENSION,
    LAST,
    LINE,
    OPENING,
    RUBBING,
    SAG,
    SHIFT,
    TUBE,
    MutableRow,
    Row,
    slot,
)
from pamsim.actuator.muscle_hysteresis import (
    hysteresis_force,
    hysteresis_rates,
    hysteresis_volume,
)
from pamsim.actuator.static_muscle import (
    contraction,
    limited,
    rigid_volume,
    static_force,
    static_volume,
    volume_and_slope,
    volume_at_nominal_length,
    volume_varies,
)
from pamsim.muscles.braid import braid_friction
from pamsim.muscles.creep import creep_force, creep_rate
from pamsim.muscles.dispatch import pushes
from pamsim.muscles.tension import effective_pressure
from pamsim.pneumatics.air import GAS_CONSTANT
from pamsim.pneumatics.chamber import absolute_pressure, air_state_rate, relaxing_rate
from pamsim.pneumatics.laminar_gap import laminar_flow
from pamsim.pneumatics.orifice import mass_flow
from pamsim.pneumatics.supply import Valves, supply_sag
from pamsim.pneumatics.tube import line_outflow, near_end_pressure
from pamsim.pneumatics.valves import (
    clamped_opening,
    line_rate,
    past_dead_zone,
    pulsed_opening,
    regulated_opening,
    slewed_opening,
    valve_flow,
)

_COMMAND = slot("command")
_FORCE_LAW = slot("force.law")
_FORCE_SCALE = slot("force.0")

_COMPLIANCE = slot("chain.compliance")
_RELAXATION = slot("chain.relaxation_time")
_BACKLASH = slot("chain.backlash")
_SEATING = slot("chain.seating_damping")
_RIPPLE = slot("chain.ripple")
_RIPPLE_PITCH = slot("chain.ripple_pitch")
_RIPPLE_PHASE = slot("chain.ripple_phase")
_STRIBECK_FORCE = slot("friction.stribeck_force")
_STRIBECK_VELOCITY = slot("friction.stribeck_velocity")
_COULOMB = slot("friction.coulomb_force")
_BREAKAWAY = slot("friction.breakaway_force")
_TENSION_SHARE = slot("friction.tension_share")
_PRESLIDING = slot("friction.presliding")
_BRISTLE_TIME = slot("friction.bristle_time")

_NOMINAL_LENGTH = slot("braid.nominal_length")


_BRAID_FRICTION = slot("braid.friction")
_STROKE_DAMPING = slot("stroke.damping")


_CREEP_STIFFNESS = slot("creep.stiffness")
_CREEP_TIME = slot("creep.relaxation_time")
_CREEP_STIFFNESS_2 = slot("creep.stiffness_2")
_CREEP_TIME_2 = slot("creep.relaxation_time_2")
_POLYTROPIC = slot("chamber.polytropic_index")
_TEMPERATURE = slot("chamber.temperature")

_ATMOSPHERE = slot("chamber.atmosphere")
_FLOOR = slot("chamber.floor")
_LEAK = slot("chamber.leak_conductance")
_LAMINAR_LEAK = slot("chamber.laminar_leak_conductance")
_HEAT_RATE = slot("chamber.heat_rate")
_FILL = slot("valve.conductance_fill")
_EXHAUST = slot("valve.conductance_exhaust")
_CRITICAL = slot("valve.critical_ratio")
_LAMINAR = slot("valve.laminar_ratio")
_SUPPLY = slot("valve.supply_pressure")
_RESISTANCE = slot("valve.supply_resistance")
_SUPPLY_VOLUME = slot("valve.supply_volume")
_LINE_LAG = slot("valve.line_lag")
_PULSE_PERIOD = slot("valve.pulse_period")
_BAND = slot("valve.regulator_band")
_DEAD_BAND = slot("valve.regulator_dead_band")
_DEAD_ZONE = slot("valve.dead_zone")
_DEAD_ZONE_ASYMMETRY = slot("valve.dead_zone_asymmetry")
_TRAVEL_TIME = slot("valve.travel_time")
_TUBE_RESISTANCE = slot("valve.tube_resistance")
_TUBE_VOLUME = slot("valve.tube_volume")

_MEASURED = 3.0  # code of the command
_TYPICAL_PRESSURE = 3e5  # gauge [Pa]: where a volume that depends on it is taken to begin with
_CLOSE = 3e-6  # relative step that may be the last of the pressure search
_LEFT = 1e-11  # and relative error that it may leave, if the next step shrinks as it did


def chain_length(par: Row, tendon_length: float) -> float:
    """Tendon length behind the sprocket's teeth [m]."""
    if par[_RIPPLE] == 0.0:
        return tendon_length
    return rippled_travel(tendon_length, par[_RIPPLE], par[_RIPPLE_PITCH], par[_RIPPLE_PHASE])


def chain_ratio(par: Row, tendon_length: float) -> float:
    """Speed behind the sprocket's teeth over that of the tendon [-]; force on it over the pull."""
    if par[_RIPPLE] == 0.0:
        return 1.0
    return rippled_ratio(tendon_length, par[_RIPPLE], par[_RIPPLE_PITCH], par[_RIPPLE_PHASE])


def length_at_muscle(par: Row, act: Row, tendon_length: float) -> float:
    """Tendon length at the muscle [m]: behind the teeth, plus the shift, minus the extension."""
    length = chain_length(par, tendon_length)
    if par[_BACKLASH] > 0.0:
        length = length + act[len(act) - SHIFT]
    if par[_COMPLIANCE] == 0.0:
        return length
    return length - act[len(act) - EXTENSION]


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
    if par[_COMMAND] == _MEASURED:
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


def tension(par: Row, act: Row, tendon_length: float, tendon_velocity: float = 0.0) -> float:
    """Force with which the actuator shortens [N]; NaN if the chamber was never charged.

    A muscle's is its tension, never negative; a pushing actuator's is negative where it pushes. The
    braid's friction is that at the speed of the tendon: a chain's stretching is left out.
    """
    pressure_abs = chamber_pressure(par, act, tendon_length)
    return tension_under(par, act, tendon_length, tendon_velocity, pressure_abs)


def tension_under(
    par: Row, act: Row, tendon_length: float, tendon_velocity: float, pressure_abs: float
) -> float:
    """`tension` [N] where the absolute pressure in the chamber [Pa] is known."""
    pressure = pressure_abs - par[_ATMOSPHERE]
    length = length_at_muscle(par, act, tendon_length)
    kappa = contraction(par, length)
    force = static_force(par, length, pressure)
    above = effective_pressure(pressure, 0.0)
    pushing = pushes(par[_FORCE_LAW])
    carried = abs(force) if pushing else force
    pull = force - hysteresis_force(par, act, kappa, above, carried)
    if par[_CREEP_STIFFNESS] > 0.0:
        pull -= creep_force(kappa, act[len(act) - CREEP], par[_CREEP_STIFFNESS])
    if par[_CREEP_STIFFNESS_2] > 0.0:
        pull -= creep_force(kappa, act[len(act) - CREEP_2], par[_CREEP_STIFFNESS_2])
    if par[_BRAID_FRICTION] > 0.0:
        speed = chain_ratio(par, tendon_length) * tendon_velocity
        rate = -speed / par[_NOMINAL_LENGTH]
        pull -= braid_friction(above, rate, par[_BRAID_FRICTION])
    if pushing:
        pull += par[_STROKE_DAMPING] * tendon_velocity
    return limited(par, pull)


def tendon_force(
    par: Row,
    act: Row,
    pull: float,
    tendon_length: float,
    tendon_velocity: float,
    timestep: float,
) -> float:
    """Force against the tendon's lengthening [N]: the muscle's tension and friction.

    Dry friction is that at the end of the time step, which the tendon's present velocity sets: with
    the one at its beginning the bristles would gain energy.

    Args:
        par: parameter row.
        act: states before the step.
        pull: tension of the muscle [N].
        tendon_length: [m].
        tendon_velocity: [m/s].
        timestep: [s].
    """
    force = pull
    if par[_RIPPLE] > 0.0:
        force = chain_ratio(par, tendon_length) * pull
    return force + tendon_friction(par, act, pull, tendon_velocity, timestep)


def tendon_friction(
    par: Row, act: Row, pull: float, tendon_velocity: float, timestep: float
) -> float:
    """Friction along the tendon against its lengthening [N], at the end of a time step.

    Args:
        par: parameter row.
        act: states before the step.
        pull: tension of the muscle [N].
        tendon_velocity: [m/s].
        timestep: [s].
    """
    force = 0.0
    if par[_STRIBECK_FORCE] > 0.0:
        force += stribeck_friction(tendon_velocity, par[_STRIBECK_FORCE], par[_STRIBECK_VELOCITY])
    if rubs(par):
        before = act[len(act) - RUBBING]
        after = dry_friction_after(par, before, pull, tendon_velocity, timestep)
        force += after + par[_BRISTLE_TIME] * (after - before) / timestep
    return force


def rubs(par: Row) -> bool:
    """Whether dry friction acts along the tendon."""
    return par[_COULOMB] + par[_BREAKAWAY] + par[_TENSION_SHARE] > 0.0


def dry_friction_after(
    par: Row, before: float, pull: float, tendon_velocity: float, timestep: float
) -> float:
    """Dry friction along the tendon after a time step [N]; 0 where there is none."""
    return dry_friction(
        before,
        tendon_velocity,
        abs(pull),
        par[_COULOMB],
        par[_BREAKAWAY],
        par[_TENSION_SHARE],
        par[_STRIBECK_VELOCITY],
        par[_PRESLIDING],
        timestep,
    )


def wanted_opening(par: Row, command: float, pressure: float, time: float) -> float:
    """Signed opening in [-1, 1] to which a command moves the valve pair, dead zone included.

    Args:
        par: parameter row.
        command: signed opening, signed duty or gauge pressure [Pa], as the row specifies.
        pressure: gauge pressure at the valves [Pa].
        time: [s].
    """
    if par[_COMMAND] == 0.0:
        return clamped_opening(command)
    if par[_COMMAND] == 1.0:
        return pulsed_opening(command, time, par[_PULSE_PERIOD])
    if par[_COMMAND] == _MEASURED:
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


def command_at_valve(par: Row, act: Row, command: float) -> float:
    """The command behind the lag of its line; any unit."""
    if par[_LINE_LAG] > 0.0:
        return act[len(act) - LINE]
    return command


def pressure_at_valve(par: Row, act: Row, tendon_length: float) -> float:
    """Absolute pressure at the valves [Pa]: the chamber's, or that at the near end of a tube."""
    if par[_TUBE_RESISTANCE] > 0.0 and par[_COMMAND] != _MEASURED:
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
        valve: (VALVE,) written, see `pamsim.pneumatics.supply.supply_sag`.
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
    return supply_sag(valves, par[_RESISTANCE], storage, full * act[len(act) - SAG])


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


def state_rates(
    par: Row,
    act: Row,
    rates: MutableRow,
    tendon_length: float,
    tendon_velocity: float,
    command: float,
    time: float,
    timestep: float,
    opposing: float = 0.0,
    sag: float = 0.0,
) -> float:
    """Write the rates of all states of one muscle.

    Args:
        par: (SIZE,) parameter row.
        act: (n,) states in the order of `pamsim.actuator.layout`.
        rates: (n,) written: their rates [1/s].
        tendon_length: [m].
        tendon_velocity: [m/s].
        command: see `valve_opening`.
        time: [s].
        timestep: [s]; an operator that steps from turning point to turning point writes the rate
            that takes it to its next memory in one Euler step of this length.
        opposing: tension of the muscle at the other end of the chain [N]; used with backlash only.
        sag: fall of the supply's pressure during the step [Pa], see `line_sag`; used with
            resistance of the supply only.

    Returns:
        Tension of the muscle [N], for `tendon_force`.
    """
    count = len(act)
    pressure_abs = chamber_pressure(par, act, tendon_length)
    pull = tension_under(par, act, tendon_length, tendon_velocity, pressure_abs)
    length = length_at_muscle(par, act, tendon_length)
    velocity = tendon_velocity
    if par[_RIPPLE] > 0.0:
        velocity = chain_ratio(par, tendon_length) * tendon_velocity
    rates[count - SHIFT] = 0.0
    if par[_BACKLASH] > 0.0:
        backlash_rate = shift_rate(
            act[count - SHIFT],
            pull,
            opposing,
            par[_BACKLASH],
            par[_SEATING],
            timestep,
        )
        rates[count - SHIFT] = backlash_rate
        velocity = velocity + backlash_rate
    rates[count - EXTENSION] = 0.0
    if par[_COMPLIANCE] > 0.0:
        stretch_rate = extension_rate(
            act[count - EXTENSION], pull, par[_COMPLIANCE], par[_RELAXATION]
        )
        rates[count - EXTENSION] = stretch_rate
        velocity = velocity - stretch_rate
    rates[count - RUBBING] = 0.0
    if rubs(par):
        before = act[count - RUBBING]
        after = dry_friction_after(par, before, pull, tendon_velocity, timestep)
        rates[count - RUBBING] = (after - before) / timestep
    kappa = contraction(par, length)
    hysteresis_rates(par, act, rates, kappa, -velocity / par[_NOMINAL_LENGTH], timestep)
    rates[count - CREEP] = 0.0
    if par[_CREEP_STIFFNESS] > 0.0:
        rates[count - CREEP] = creep_rate(kappa, act[count - CREEP], par[_CREEP_TIME], timestep)
    rates[count - CREEP_2] = 0.0
    if par[_CREEP_STIFFNESS_2] > 0.0:
        relaxed, time_2 = act[count - CREEP_2], par[_CREEP_TIME_2]
        rates[count - CREEP_2] = creep_rate(kappa, relaxed, time_2, timestep)
    if par[_COMMAND] == _MEASURED:
        for i in (LINE, SAG, OPENING, TUBE, AMBIENT, LAST, EARLIER):
            rates[count - i] = 0.0
        imposed = command + par[_ATMOSPHERE]
        if imposed < par[_FLOOR]:
            imposed = par[_FLOOR]
        rates[count - AIR] = (imposed - act[count - AIR]) / timestep
        return pull
    rates[count - LINE] = 0.0
    at_valve = command_at_valve(par, act, command)
    if par[_LINE_LAG] > 0.0:
        sent = command if par[_COMMAND] == 2.0 else clamped_opening(command)
        rates[count - LINE] = line_rate(sent, at_valve, par[_LINE_LAG], timestep)
    rates[count - SAG] = 0.0
    if par[_RESISTANCE] > 0.0:
        share = sag / (par[_SUPPLY] + par[_ATMOSPHERE])
        rates[count - SAG] = (share - act[count - SAG]) / timestep
    at_valve_abs = pressure_abs
    if par[_TUBE_RESISTANCE] > 0.0:
        at_valve_abs = act[count - TUBE]
    opening = reached_opening(par, act, at_valve, at_valve_abs - par[_ATMOSPHERE], time, timestep)
    rates[count - OPENING] = 0.0
    if par[_TRAVEL_TIME] > 0.0:
        rates[count - OPENING] = (opening - act[count - OPENING]) / timestep
    flow = flow_through_valves(par, at_valve_abs, left_by_dead_zone(par, opening), sag)
    rates[count - TUBE] = 0.0
    if par[_TUBE_RESISTANCE] > 0.0:
        room, warmth = par[_TUBE_VOLUME], par[_TEMPERATURE]
        after = near_end_pressure(
            at_valve_abs, pressure_abs, flow, par[_TUBE_RESISTANCE], room, warmth, timestep
        )
        rates[count - TUBE] = (after - at_valve_abs) / timestep
        flow = line_outflow(flow, after - at_valve_abs, room, warmth, timestep)
    flow -= leak_flow(par, pressure_abs)
    rates[count - LAST] = 0.0
    rates[count - EARLIER] = 0.0
    if volume_varies(par):
        rates[count - LAST] = (pressure_abs - act[count - LAST]) / timestep
        rates[count - EARLIER] = (act[count - LAST] - act[count - EARLIER]) / timestep
    rates[count - AIR] = air_state_rate(pressure_abs, par[_POLYTROPIC], par[_TEMPERATURE], flow)
    rates[count - AMBIENT] = 0.0
    if par[_HEAT_RATE] > 0.0:
        air = act[count - AIR]
        inside = chamber_volume(par, act, length, pressure_abs - par[_ATMOSPHERE])
        ambient = act[count - AMBIENT] / inside
        rates[count - AMBIENT] = GAS_CONSTANT * par[_TEMPERATURE] * flow
        rates[count - AIR] += relaxing_rate(
            air, pressure_abs, ambient, par[_POLYTROPIC], par[_HEAT_RATE], timestep
        )
    return pull
