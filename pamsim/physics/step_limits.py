"""What limits the time step of a muscle: its chain, dry friction and the pressure's regulator."""

from __future__ import annotations

import math

from pamsim.physics.air import GAS_CONSTANT, mass_flow
from pamsim.physics.antagonist import muscle_stiffness
from pamsim.physics.friction import rubs
from pamsim.physics.muscle import Muscle
from pamsim.physics.record import parameters
from pamsim.physics.static_muscle import limited, static_force, volume_at_nominal_length
from pamsim.physics.valves import WIDEST_DEAD_ZONE, has_tube, largest_factor


def chain_step_limit(muscle: Muscle, tendon_length: float, pressure: float) -> float:
    """Longest time step in which the chain's extension and its shift do not oscillate.

    Extension x and tension T of a muscle of stiffness k obey x' = (C T - x) / tau, dT/dx = -k, a
    lag of time constant tau / (1 + C k). Within its backlash the chain shifts between two such
    muscles by s' = -2 k s / b. Either grows if an explicit step exceeds twice the time constant:
    the smaller of 2 tau / (1 + C k) and b / k [s], infinite on a rigid chain without backlash. The
    stiffness is that at a tendon length [m] and a gauge pressure [Pa].
    """
    chain, limit = muscle.chain, math.inf
    if chain.compliance == 0.0 and chain.backlash == 0.0:
        return limit
    stiffness = max(muscle_stiffness(parameters(muscle), tendon_length, pressure).total, 0.0)
    if chain.compliance > 0.0:
        limit = 2.0 * chain.relaxation_time / (1.0 + chain.compliance * stiffness)
    if chain.backlash > 0.0 and stiffness > 0.0:
        limit = min(limit, chain.seating_damping / stiffness)
    return limit


def bristle_stiffness(muscle: Muscle, tendon_length: float, pressure: float) -> float:
    """Stiffness of the bristles of dry friction before they slip, k [N/m]; 0 without friction."""
    friction = muscle.friction
    if not rubs(friction):
        return 0.0
    row = parameters(muscle)
    pull = abs(limited(row, static_force(row, tendon_length, pressure)))
    level = friction.coulomb_force + friction.breakaway_force + friction.dwell_force
    return (level + friction.tension_share * pull) / friction.presliding


def regulator_time_constant(muscle: Muscle) -> float:
    """Time in which the set-point regulator settles inside its proportional band [s].

    There the opening is the error over the band, so the pressure follows a lag: the band over the
    pressure's rate at full opening, where that is largest, with choked flow from the supply into a
    muscle at nominal length. A dead zone leaves the more slope to the rest of the band. Explicit
    steps longer than this overshoot the set point.
    """
    chamber, valve = muscle.chamber, muscle.valve
    air = (valve.critical_ratio, valve.laminar_ratio, chamber.temperature)
    largest = max(valve.conductance_fill, valve.conductance_exhaust) * largest_factor(valve)
    flow = mass_flow(valve.supply_pressure + chamber.atmosphere, 0.0, largest, *air)
    rate = chamber.polytropic_index * GAS_CONSTANT * chamber.temperature * flow
    dead = min(valve.dead_zone * (1.0 + abs(valve.dead_zone_asymmetry)), WIDEST_DEAD_ZONE)
    room = volume_at_nominal_length(parameters(muscle))
    if has_tube(valve):
        # The regulator then sees the pressure in the tube, whose air stays at its temperature.
        room = min(room, valve.tube_volume * chamber.polytropic_index)
    return valve.regulator_band * (1.0 - dead) * room / max(rate, 1e-300)
