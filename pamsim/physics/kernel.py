"""The muscle actuator: the one composition of all laws, from parameters and state to force.

Every function takes the parameter row ``par`` and the states ``act`` of one actuator in the layout
of `pamsim.physics.layout`. They are ordinary Python over anything that can be indexed, and the
engine compiles these same functions for the muscles' plugin. An effect at its neutral value leaves
the result unchanged to the last bit.
"""

from __future__ import annotations

from pamsim.physics.air import GAS_CONSTANT
from pamsim.physics.braid import braid_friction
from pamsim.physics.chain import extension_rate, shift_rate
from pamsim.physics.chamber import air_state_rate, relaxing_rate
from pamsim.physics.chamber_pressure import chamber_pressure, chamber_volume
from pamsim.physics.commands import MEASURED
from pamsim.physics.creep import creep_force, creep_rate
from pamsim.physics.force_laws.dispatch import pushes
from pamsim.physics.friction import dry_friction, stribeck_friction
from pamsim.physics.layout import (
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
from pamsim.physics.muscle_hysteresis import hysteresis_force, hysteresis_rates
from pamsim.physics.muscle_length import chain_ratio, length_at_muscle
from pamsim.physics.muscle_valves import (
    command_at_valve,
    flow_through_valves,
    lags,
    leak_flow,
    left_by_dead_zone,
    line_change,
    reached_opening,
    sags,
)
from pamsim.physics.static_muscle import contraction, limited, static_force, volume_varies
from pamsim.physics.tension import effective_pressure
from pamsim.physics.tube import line_outflow, near_end_pressure

_COMMAND = slot("command")
_FORCE_LAW = slot("force.law")
_COMPLIANCE = slot("chain.compliance")
_RELAXATION = slot("chain.relaxation_time")
_BACKLASH = slot("chain.backlash")
_SEATING = slot("chain.seating_damping")
_RIPPLE = slot("chain.ripple")
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
_HEAT_RATE = slot("chamber.heat_rate")
_SUPPLY = slot("valve.supply_pressure")
_TRAVEL_TIME = slot("valve.travel_time")
_TUBE_RESISTANCE = slot("valve.tube_resistance")
_TUBE_VOLUME = slot("valve.tube_volume")


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
        act: (n,) states in the order of `pamsim.physics.layout`.
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
    if par[_COMMAND] == MEASURED:
        for i in (LINE, SAG, OPENING, TUBE, AMBIENT, LAST, EARLIER):
            rates[count - i] = 0.0
        imposed = command + par[_ATMOSPHERE]
        if imposed < par[_FLOOR]:
            imposed = par[_FLOOR]
        rates[count - AIR] = (imposed - act[count - AIR]) / timestep
        return pull
    rates[count - LINE] = 0.0
    at_valve = command_at_valve(par, act, command)
    if lags(par):
        rates[count - LINE] = line_change(par, command, at_valve, timestep)
    rates[count - SAG] = 0.0
    if sags(par):
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
