"""The muscle actuator: the one composition of all laws, from parameters and state to force.

``m`` are the parameters of one actuator, ``s`` its states and ``z`` its memory of hysteresis, see
`pamsim.physics.record`; ``ds`` and ``dz`` are the rates that are written. The functions are
ordinary Python, and the engine compiles these same functions for the muscles' plugin. An effect at
its neutral value leaves the result unchanged to the last bit.
"""

from __future__ import annotations

from pamsim.physics.air import GAS_CONSTANT
from pamsim.physics.chain import chain_ratio, extension_rate, shift_rate
from pamsim.physics.chamber import air_state, air_state_rate, relaxing_rate
from pamsim.physics.chamber_pressure import chamber_pressure, chamber_volume
from pamsim.physics.chosen_law import law_pushes
from pamsim.physics.friction import bond_rate, dry_friction, rubs, tendon_friction
from pamsim.physics.learned import learned_force, learns
from pamsim.physics.muscle_hysteresis import hysteresis_force, hysteresis_rates
from pamsim.physics.muscle_valves import (
    flow_through_valves,
    leak_flow,
    line_rate,
    pressure_at_valve,
    reached_opening,
    tube_step,
)
from pamsim.physics.passive import creep_rate, first_stroke_force, softening_rate
from pamsim.physics.record import MutableRow, Parameters, Row, States
from pamsim.physics.static_muscle import (
    contraction,
    length_at_muscle,
    limited,
    static_force,
    volume_varies,
)
from pamsim.physics.supply import sags
from pamsim.physics.tension import effective_pressure
from pamsim.physics.valves import MEASURED, has_tube


def tension(
    m: Parameters, s: States, z: Row, tendon_length: float, tendon_velocity: float = 0.0
) -> float:
    """Force with which the actuator shortens [N]; NaN where it has no volume.

    A muscle's is its tension, never negative; a pushing actuator's is negative where it pushes. The
    braid's friction is that at the speed of the tendon: a chain's stretching is left out.
    """
    pressure_abs = chamber_pressure(m, s, z, tendon_length)
    return tension_under(m, s, z, tendon_length, tendon_velocity, pressure_abs)


def tension_under(
    m: Parameters,
    s: States,
    z: Row,
    tendon_length: float,
    tendon_velocity: float,
    pressure_abs: float,
) -> float:
    """`tension` [N] where the absolute pressure in the chamber [Pa] is known."""
    pressure = pressure_abs - m.chamber.atmosphere
    length = length_at_muscle(m, s, tendon_length)
    kappa = contraction(m, length)
    force = static_force(m, length, pressure)
    if m.softening.share != 0.0:
        force *= 1.0 - m.softening.share * s.softened
    above = effective_pressure(pressure, 0.0)
    pushing = law_pushes(m)
    carried = abs(force) if pushing else force
    pull = force - hysteresis_force(m, z, kappa, above, carried)
    pull -= m.creep.stiffness * (kappa - s.creep)
    pull -= m.creep.stiffness_2 * (kappa - s.creep_2)
    if m.first_stroke.force > 0.0:
        pull -= first_stroke_force(m.first_stroke, kappa, s.furthest)
    if m.braid.friction > 0.0:
        # The fibres rub as the pressure presses them on each other. That the force grows in
        # proportion to the rate as well is the simplest law that only dissipates.
        rate = -(chain_ratio(m.chain, tendon_length) * tendon_velocity) / m.braid.nominal_length
        pull -= m.braid.friction * above * rate
    if pushing:
        pull += m.stroke.damping * tendon_velocity
    return limited(m, pull)


def tendon_force(
    m: Parameters,
    s: States,
    pull: float,
    tendon_length: float,
    tendon_velocity: float,
    timestep: float,
) -> float:
    """Force against the tendon's lengthening [N]: the muscle's tension, ``pull`` [N], and others.

    The states are those before the step, length [m] and velocity [m/s] the present ones; dry
    friction is that at the end of the step [s], by the bonds at its beginning.
    """
    rubbed = tendon_friction(m.friction, s.friction, pull, tendon_velocity, timestep, s.bonds)
    force = chain_ratio(m.chain, tendon_length) * pull + rubbed
    if learns(m.learned):
        force += learned_force(m.learned, tendon_length, tendon_velocity)
    return force


def state_rates(
    m: Parameters,
    s: States,
    z: Row,
    ds: States,
    dz: MutableRow,
    tendon_length: float,
    tendon_velocity: float,
    command: float,
    time: float,
    timestep: float,
    opposing: float = 0.0,
    sag: float = 0.0,
    crossing: float = 0.0,
) -> float:
    """Write the rates of all states of one muscle.

    Args:
        m: parameters.
        s: states.
        z: memory of hysteresis.
        ds: written, the rates of the states [1/s].
        dz: written, as many as ``z``, its rates [1/s].
        tendon_length: [m].
        tendon_velocity: [m/s].
        command: see `wanted_opening`.
        time: [s].
        timestep: [s]; an operator that steps from turning point to turning point writes the rate
            that takes it to its next memory in one Euler step of this length.
        opposing: tension of the muscle at the other end of the chain [N]; used with backlash only.
        sag: fall of the supply's pressure during the step [Pa], see `supply_sag`; used with
            resistance of the supply only.
        crossing: flow that leaks in from the muscle at the other end of the chain, see
            `cross_flow` [kg/s].

    Returns:
        Tension of the muscle [N], for `tendon_force`.
    """
    pressure_abs = chamber_pressure(m, s, z, tendon_length)
    pull = tension_under(m, s, z, tendon_length, tendon_velocity, pressure_abs)
    length = length_at_muscle(m, s, tendon_length)
    velocity = chain_ratio(m.chain, tendon_length) * tendon_velocity
    ds.shift = ds.extension = ds.friction = ds.bonds = ds.creep = ds.creep_2 = 0.0
    ds.softened = ds.furthest = ds.line = ds.sag = ds.opening = ds.tube_pressure = 0.0
    ds.ambient_air = ds.last_pressure = ds.earlier_pressure = 0.0
    if m.chain.backlash > 0.0:
        sliding = shift_rate(m.chain, s.shift, pull, opposing, timestep)
        ds.shift = sliding
        velocity += sliding
    if m.chain.compliance > 0.0:
        stretching = extension_rate(m.chain, s.extension, pull)
        ds.extension = stretching
        velocity -= stretching
    if rubs(m.friction):
        after = dry_friction(m.friction, s.friction, pull, tendon_velocity, timestep, s.bonds)
        ds.friction = (after - s.friction) / timestep
    if m.friction.dwell_force > 0.0:
        ds.bonds = bond_rate(m.friction, s.bonds, tendon_velocity, timestep)
    kappa = contraction(m, length)
    hysteresis_rates(m, z, dz, kappa, -velocity / m.braid.nominal_length, timestep)
    if m.softening.share != 0.0:
        ds.softened = softening_rate(m.softening, s.softened, timestep)
    if m.first_stroke.force > 0.0 and not kappa <= s.furthest:
        ds.furthest = (kappa - s.furthest) / timestep
    if m.creep.stiffness > 0.0:
        ds.creep = creep_rate(kappa, s.creep, m.creep.relaxation_time, timestep)
    if m.creep.stiffness_2 > 0.0:
        ds.creep_2 = creep_rate(kappa, s.creep_2, m.creep.relaxation_time_2, timestep)
    if m.command == MEASURED:
        imposed = command + m.chamber.atmosphere
        if imposed < m.chamber.floor:
            imposed = m.chamber.floor
        ds.air = (imposed - s.air) / timestep
        return pull
    ds.line = line_rate(m, s, command, timestep)
    if sags(m):
        share = sag / (m.valve.supply_pressure + m.chamber.atmosphere)
        ds.sag = (share - s.sag) / timestep
    at_valve_abs = pressure_at_valve(m, s, pressure_abs)
    opening = reached_opening(m, s, command, at_valve_abs, time, timestep)
    if m.valve.travel_time + m.valve.hysteresis > 0.0:
        ds.opening = (opening - s.opening) / timestep
    flow = flow_through_valves(m, at_valve_abs, opening, sag)
    if has_tube(m.valve):
        after, flow = tube_step(m, at_valve_abs, pressure_abs, flow, timestep)
        ds.tube_pressure = (after - s.tube_pressure) / timestep
    flow += crossing - leak_flow(m, pressure_abs)
    if volume_varies(m):
        ds.last_pressure = (pressure_abs - s.last_pressure) / timestep
        ds.earlier_pressure = (s.last_pressure - s.earlier_pressure) / timestep
    ds.air = air_state_rate(m.chamber, pressure_abs, flow)
    air, ambient_air = s.air, s.ambient_air
    if air == 0.0:  # as `mj_resetData` leaves it: the step begins with ambient air
        inside = chamber_volume(m, z, length, pressure_abs - m.chamber.atmosphere)
        air = air_state(m.chamber, pressure_abs, inside)
        ambient_air = pressure_abs * inside
        ds.air += air / timestep
        ds.ambient_air = ambient_air / timestep
    if m.chamber.heat_rate > 0.0:
        inside = chamber_volume(m, z, length, pressure_abs - m.chamber.atmosphere)
        ds.ambient_air += GAS_CONSTANT * m.chamber.temperature * flow
        ds.air += relaxing_rate(m.chamber, air, pressure_abs, ambient_air / inside, timestep)
    return pull
