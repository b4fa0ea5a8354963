"""How fast a muscle's pressure regulator acts, which bounds the time step it can take."""

from __future__ import annotations

from pamsim.physics.air import GAS_CONSTANT
from pamsim.physics.muscle import Muscle
from pamsim.physics.orifice import mass_flow
from pamsim.physics.record import parameters
from pamsim.physics.static_muscle import volume_at_nominal_length
from pamsim.physics.valves import own_dead_zone


def regulator_time_constant(muscle: Muscle) -> float:
    """Time in which the set-point regulator settles inside its proportional band.

    Inside the band the opening is the error over the band, so the pressure follows a lag whose
    time constant is the band over the pressure's rate at full opening. The rate is taken where it
    is largest: choked flow from the supply into a muscle at nominal length. A dead zone of the
    valves leaves the more slope to the rest of the band.

    Args:
        muscle: its size, chamber and valves count.

    Returns:
        Time constant [s]; explicit steps longer than it overshoot the set point.
    """
    chamber, valve = muscle.chamber, muscle.valve
    flow = mass_flow(
        valve.supply_pressure + chamber.atmosphere,
        0.0,
        max(valve.conductance_fill, valve.conductance_exhaust),
        valve.critical_ratio,
        valve.laminar_ratio,
        chamber.temperature,
    )
    rate = chamber.polytropic_index * GAS_CONSTANT * chamber.temperature * flow
    widest = own_dead_zone(valve.dead_zone, 1.0 + abs(valve.dead_zone_asymmetry))
    band = valve.regulator_band * (1.0 - widest)
    room = volume_at_nominal_length(parameters(muscle))
    if valve.tube_resistance > 0.0:
        # The regulator then sees the pressure in the tube, whose air stays at its temperature.
        room = min(room, valve.tube_volume * chamber.polytropic_index)
    return band * room / max(rate, 1e-300)
