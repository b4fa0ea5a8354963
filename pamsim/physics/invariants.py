"""What holds in every time step of a muscle, whatever its parameters, commands and load.

- Every state is finite.
- The chamber's absolute pressure is above 0, and not above what the supply gives to the largest
  volume of the muscle, compressed without loss of air to the present one: valves let no air in
  above the supply's pressure, so P <= P_s (V_max / V)^n. With heat exchange, air that an expansion
  from P_s to the atmosphere has cooled may warm up behind shut valves: once more (P_s / P_a)^((n -
  1) / n). A start above the supply's pressure counts as impossible.
- A muscle's tension is not negative; only an actuator whose law pushes may push.
- Air is neither made nor lost: what chamber and tube gain in the step is what the valves let in,
  less the leaks. The states before the step are those after it less the step's change, which rounds
  each by about 4e-16 of itself, and with it the pressure; the opening of a regulator is off by that
  over its band, the flow near equal pressures by that over 1 - `valve.laminar_ratio`. Where the
  volume depends on the pressure, `chamber_pressure` is accurate to 1e-11 of itself instead. The
  balance has to hold to that share of the flow through open valves and leaks.
"""

from __future__ import annotations

import math

from pamsim.physics.air import GAS_CONSTANT, REFERENCE_DENSITY
from pamsim.physics.chain import chain_ripples
from pamsim.physics.chamber_pressure import chamber_pressure, chamber_volume
from pamsim.physics.chosen_law import law_pushes
from pamsim.physics.friction import rubs
from pamsim.physics.kernel import tension
from pamsim.physics.learned import learns
from pamsim.physics.muscle_valves import flow_through_valves, leak_flow, reached_opening
from pamsim.physics.record import STATE_WORDS, MutableRow, Parameters, Row, States
from pamsim.physics.static_muscle import length_at_muscle, static_volume, volume_varies
from pamsim.physics.supply import sags
from pamsim.physics.valves import MEASURED, PULSE, has_tube, largest_factor

NOTHING, FINITE, PRESSURE, TENSION, MASS = 0.0, 1.0, 2.0, 3.0, 4.0
"""Codes of what is broken."""

ABOVE_SUPPLY = 5.0
"""Code of a set point that the supply cannot reach, which breaks nothing."""

_ROUNDING = 4e-16
_OPERATIONS = 100.0  # roundings that add up from state to flow, a stretched dead zone included
_SEARCH = 1e-11  # relative error of a pressure that is searched for
_MARGIN = 1.05  # on the highest pressure, for one explicit step of filling
_EMPTY = 1e-9  # share of its air in a chamber before the step that charges it, but for rounding
_PLACES = 50  # contractions at which the largest volume is looked for


def broken_invariant(
    m: Parameters,
    before: States,
    memory_before: Row,
    s: States,
    ds: States,
    tendon_length: float,
    tendon_velocity: float,
    force: float,
    command: float,
    time: float,
    timestep: float,
    crossing: float,
    found: MutableRow,
) -> float:
    """The first invariant that a time step of a muscle has broken.

    Of parameters, states and memory of hysteresis before the step, states after it and their rates;
    tendon length [m] and velocity [m/s] before it; the force along the tendon that the engine
    applied, negative where the muscle pulls [N]; the command, see
    `pamsim.physics.muscle_valves.wanted_opening`; time before the step and its length [s]; the flow
    that leaked in from another muscle [kg/s].

    Returns:
        Its code, `NOTHING` if all hold. The number that is wrong, and what bounds it, are written
        to ``found`` (2,).
    """
    if not before.air > _EMPTY * s.air:
        return NOTHING  # the step with which a chamber is charged, see `state_rates`
    pressure = chamber_pressure(m, before, memory_before, tendon_length)
    supply = m.valve.supply_pressure + m.chamber.atmosphere
    if not pressure > 0.0:
        found[0], found[1] = pressure, 0.0
        return PRESSURE
    if pressure > _MARGIN * supply and m.command != MEASURED:
        highest = _highest_pressure(m, before, memory_before, tendon_length, pressure)
        if not pressure <= highest:
            found[0], found[1] = pressure, highest
            return PRESSURE
    if not law_pushes(m):
        pull = -force
        braked = rubs(m.friction) or m.friction.stribeck_force > 0.0 or learns(m.learned)
        if braked or chain_ripples(m.chain):
            # The force along the tendon is another than the muscle's.
            pull = tension(m, before, memory_before, tendon_length, tendon_velocity)
        if not pull >= 0.0:
            found[0], found[1] = pull, 0.0
            return TENSION
    if m.command == MEASURED:
        return NOTHING
    at_valve = before.tube_pressure if has_tube(m.valve) else pressure
    gained = pressure ** (1.0 - 1.0 / m.chamber.polytropic_index) * ds.air
    if m.chamber.heat_rate > 0.0:  # which changes the air state too
        gained = ds.ambient_air
    if has_tube(m.valve):
        gained += m.valve.tube_volume * ds.tube_pressure
    gained /= GAS_CONSTANT * m.chamber.temperature
    allowed = _rounding_of_flow(m, pressure, at_valve, time, timestep)
    sag = 0.0
    if sags(m):  # the valves see the sag at the end of the step
        sag = s.sag * supply
    opening = reached_opening(m, before, command, at_valve, time, timestep)
    entered = flow_through_valves(m, at_valve, opening, sag)
    missing = abs(gained - entered - crossing + leak_flow(m, pressure))
    if not missing <= allowed:
        found[0], found[1] = missing, allowed
        return MASS
    return NOTHING


def not_finite(act: Row) -> int:
    """Place of a state that is not finite, counted from the end, the air first; 0 if all are."""
    for place in range(1, len(act) + 1):
        if not math.isfinite(act[len(act) - place]):
            return place
    return 0


def state_name(place: int) -> str:
    """Name of a state in words, by its place from the end of ``act``."""
    return "hysteresis" if place > len(STATE_WORDS) else [*STATE_WORDS.values()][-place]


def _highest_pressure(
    m: Parameters, s: States, z: Row, tendon_length: float, pressure: float
) -> float:
    """What the absolute pressure of a chamber filled by its supply cannot exceed [Pa]."""
    gauge, nominal = pressure - m.chamber.atmosphere, m.braid.nominal_length
    supply = m.valve.supply_pressure + m.chamber.atmosphere
    inside = chamber_volume(m, z, length_at_muscle(m, s, tendon_length), gauge)
    first, last = 0.0, 0.5
    if law_pushes(m):
        first, last = -1.0, 1.0
    # Hysteresis adds at most what its chords do, since it holds energy.
    chords = m.parallel_hysteresis.force_per_pressure * m.parallel_hysteresis.chord
    chords += m.hysteresis.force_per_pressure * m.hysteresis.chord
    largest = inside
    for i in range(_PLACES + 1):
        kappa = first + (last - first) * i / _PLACES
        length = (1.0 - kappa) * nominal - m.mounting.length_at_zero
        by_chords = 0.5 * chords * nominal * kappa * kappa
        largest = max(largest, static_volume(m, length, gauge) + by_chords)
    index = m.chamber.polytropic_index
    highest = supply * (largest / inside) ** index
    if m.chamber.heat_rate > 0.0:
        highest *= max(supply / m.chamber.atmosphere, 1.0) ** (1.0 - 1.0 / index)
    return _MARGIN * highest


def _rounding_of_flow(
    m: Parameters, pressure: float, at_valve: float, time: float, timestep: float
) -> float:
    """What rounding may add to the balance of air [kg/s]; see the top of this module."""
    uncertain = _SEARCH if volume_varies(m) else _OPERATIONS * _ROUNDING
    upstream = max(pressure, at_valve, m.valve.supply_pressure + m.chamber.atmosphere)
    per_volume = GAS_CONSTANT * m.chamber.temperature
    steep = 1.0 / (1.0 - m.valve.laminar_ratio) + upstream / m.valve.regulator_band
    if m.command == PULSE:  # which switches within a step, at an instant known to its rounding
        steep += abs(time) / timestep
    conductance = max(m.valve.conductance_fill, m.valve.conductance_exhaust)
    conductance *= largest_factor(m.valve)
    conductance += m.chamber.leak_conductance
    gaps = m.chamber.laminar_leak_conductance + m.chamber.cross_leak_conductance
    through_gap = gaps * upstream / per_volume
    flow = 2.0 * upstream * (conductance * REFERENCE_DENSITY + through_gap)
    stored = 0.0
    if has_tube(m.valve):
        stored = m.valve.tube_volume * upstream / (per_volume * timestep)
    return uncertain * steep * flow + _OPERATIONS * _ROUNDING * stored
