"""What holds in every time step of a muscle, whatever its parameters, commands and load.

- Every state is finite.
- The chamber's absolute pressure is above 0, and not above what the supply gives to the largest
  volume of the muscle, compressed without loss of air to the present one: valves let no air in
  above the supply's pressure, so P <= P_s (V_max / V)^n. With heat exchange, air that an expansion
  from P_s to the atmosphere has cooled may warm up behind shut valves: once more (P_s / P_a)^((n -
  1) / n). A start above the supply's pressure counts as impossible.
- A muscle's tension is not negative; only an actuator whose law pushes may push.
- Air is neither made nor lost: what chamber and tube gain in the step is what the valves let in,
  less the leak. The states before the step are those after it less the step's change, which rounds
  each by about 4e-16 of itself. The pressure is then off by as much, the opening of a regulator by
  that of the pressure over its band, and the flow near equal pressures by that of the pressure over
  1 - `valve.laminar_ratio`. Where the volume depends on the pressure, `chamber_pressure` is
  accurate to 1e-11 of itself instead. The balance has to hold to that share of the flow through
  open valves and leaks: to 4e-11 of it at a laminar ratio of 0.999.
"""

from __future__ import annotations

import math

from pamsim.physics.air import GAS_CONSTANT, REFERENCE_DENSITY
from pamsim.physics.chamber_pressure import chamber_pressure, chamber_volume
from pamsim.physics.commands import MEASURED, PULSE
from pamsim.physics.force_laws.dispatch import pushes
from pamsim.physics.kernel import rubs, tension
from pamsim.physics.layout import AIR, AMBIENT, SAG, TUBE, MutableRow, Row, slot
from pamsim.physics.muscle_length import length_at_muscle
from pamsim.physics.muscle_valves import (
    command_at_valve,
    flow_through_valves,
    leak_flow,
    left_by_dead_zone,
    reached_opening,
    sags,
)
from pamsim.physics.static_muscle import static_volume, volume_varies

NOTHING, FINITE, PRESSURE, TENSION, MASS = 0.0, 1.0, 2.0, 3.0, 4.0
"""Codes of what is broken."""

ABOVE_SUPPLY = 5.0
"""Code of a set point that the supply cannot reach, which breaks nothing."""

_COMMAND = slot("command")
_FORCE_LAW = slot("force.law")
_NOMINAL_LENGTH, _LENGTH_AT_ZERO = slot("braid.nominal_length"), slot("mounting.length_at_zero")
_HYSTERESIS_LAW, _PER_PRESSURE = slot("hysteresis.law"), slot("hysteresis.0") + 1
_CHORD = slot("hysteresis.0") + 3
_PARALLEL_PER_PRESSURE = slot("parallel_hysteresis.force_per_pressure")
_PARALLEL_CHORD = slot("parallel_hysteresis.chord")
_POLYTROPIC, _TEMPERATURE = slot("chamber.polytropic_index"), slot("chamber.temperature")
_ATMOSPHERE, _HEAT_RATE = slot("chamber.atmosphere"), slot("chamber.heat_rate")
_LEAK, _LAMINAR_LEAK = slot("chamber.leak_conductance"), slot("chamber.laminar_leak_conductance")
_FILL, _EXHAUST = slot("valve.conductance_fill"), slot("valve.conductance_exhaust")
_LAMINAR, _BAND = slot("valve.laminar_ratio"), slot("valve.regulator_band")
_SUPPLY = slot("valve.supply_pressure")
_TUBE_RESISTANCE, _TUBE_VOLUME = slot("valve.tube_resistance"), slot("valve.tube_volume")
_RIPPLE, _STRIBECK = slot("chain.ripple"), slot("friction.stribeck_force")

_ROUNDING = 4e-16
_OPERATIONS = 100.0
"""Roundings that add up from state to flow, a stretched dead zone included."""

_SEARCH = 1e-11
"""Relative error of a pressure that is searched for."""

_MARGIN = 1.05
"""On the highest pressure, for one explicit step of filling."""

_PLACES = 50
"""Contractions at which the largest volume is looked for."""


def broken_invariant(
    par: Row,
    before: Row,
    act: Row,
    rates: Row,
    tendon_length: float,
    tendon_velocity: float,
    force: float,
    command: float,
    time: float,
    timestep: float,
    found: MutableRow,
) -> float:
    """The first invariant that a time step of a muscle has broken.

    Args:
        par: (SIZE,) parameter row.
        before: (n,) states before the step.
        act: (n,) states after it.
        rates: (n,) of the step [1/s].
        tendon_length: before it [m].
        tendon_velocity: before it [m/s].
        force: that the engine applied along the tendon, negative where the muscle pulls [N].
        command: during it, see `pamsim.physics.muscle_valves.valve_opening`.
        time: before it [s].
        timestep: [s].
        found: (2,) written where one is broken: the number, and what bounds it; of a state that is
            not finite its place, counted from the end as in `pamsim.physics.layout`.

    Returns:
        Its code, `NOTHING` if all hold.
    """
    for place in range(1, len(act) + 1):  # the air first: without it much else is no number
        state = act[len(act) - place]
        if not math.isfinite(state):
            found[0], found[1] = state, float(place)
            return FINITE
    pressure = chamber_pressure(par, before, tendon_length)
    supply = par[_SUPPLY] + par[_ATMOSPHERE]
    if not pressure > 0.0:
        found[0], found[1] = pressure, 0.0
        return PRESSURE
    if pressure > _MARGIN * supply and par[_COMMAND] != MEASURED:
        highest = highest_pressure(par, before, tendon_length, pressure)
        if not pressure <= highest:
            found[0], found[1] = pressure, highest
            return PRESSURE
    if not pushes(par[_FORCE_LAW]):
        pull = -force
        if _has_friction(par):  # which the engine's force includes
            pull = tension(par, before, tendon_length, tendon_velocity)
        if not pull >= 0.0:
            found[0], found[1] = pull, 0.0
            return TENSION
    if par[_COMMAND] == MEASURED:
        return NOTHING
    at_valve = pressure
    if par[_TUBE_RESISTANCE] > 0.0:
        at_valve = before[len(before) - TUBE]
    gained = air_gained(par, pressure, rates)
    allowed = rounding_of_flow(par, pressure, at_valve, timestep)
    missing = math.inf
    # Valves that pulse switch at an instant, which is known to its rounding.
    for shift in (0.0, 1.0, -1.0):
        if shift == 0.0 or (par[_COMMAND] == PULSE and not missing <= allowed):
            clock = time + shift * _ROUNDING * (abs(time) + timestep)
            entered = flow_in(par, before, act, at_valve, command, clock, timestep)
            missing = abs(gained - entered + leak_flow(par, pressure))
    if not missing <= allowed:
        found[0], found[1] = missing, allowed
        return MASS
    return NOTHING


def never_charged(act: Row) -> bool:
    """Whether a chamber was never filled, as in the step with which the engine tries a new model.

    Its pressure and force are not a number, which is what shall be. Filling it sets these states,
    which nothing else changes to 0.

    Args:
        act: states.
    """
    return act[len(act) - TUBE] == 0.0 or act[len(act) - AMBIENT] == 0.0


def _has_friction(par: Row) -> bool:
    """Whether the force along the tendon is another than the muscle's."""
    return rubs(par) or par[_STRIBECK] > 0.0 or par[_RIPPLE] > 0.0


def highest_pressure(par: Row, act: Row, tendon_length: float, pressure: float) -> float:
    """What the pressure of a chamber filled by its supply cannot exceed [Pa, absolute].

    Args:
        par: parameter row.
        act: states.
        tendon_length: [m].
        pressure: absolute, at which the volumes are taken [Pa].
    """
    gauge, nominal = pressure - par[_ATMOSPHERE], par[_NOMINAL_LENGTH]
    supply = par[_SUPPLY] + par[_ATMOSPHERE]
    inside = chamber_volume(par, act, length_at_muscle(par, act, tendon_length), gauge)
    largest, first, last = inside, 0.0, 0.5
    if pushes(par[_FORCE_LAW]):
        first, last = -1.0, 1.0
    for i in range(_PLACES + 1):
        kappa = first + (last - first) * i / _PLACES
        length = (1.0 - kappa) * nominal - par[_LENGTH_AT_ZERO]
        inside_there = static_volume(par, length, gauge)
        # Hysteresis adds at most what its chords do, since it holds energy.
        chords = par[_PARALLEL_PER_PRESSURE] * par[_PARALLEL_CHORD]
        if par[_HYSTERESIS_LAW] > 0.0:
            chords += par[_PER_PRESSURE] * par[_CHORD]
        inside_there += 0.5 * chords * nominal * kappa * kappa
        largest = max(largest, inside_there)
    index = par[_POLYTROPIC]
    highest = supply * (largest / inside) ** index
    if par[_HEAT_RATE] > 0.0:
        highest *= max(supply / par[_ATMOSPHERE], 1.0) ** (1.0 - 1.0 / index)
    return _MARGIN * highest


def air_gained(par: Row, pressure: float, rates: Row) -> float:
    """Rate at which chamber and tube gain air by the rates of their states [kg/s].

    Args:
        par: parameter row.
        pressure: absolute, in the chamber [Pa].
        rates: of all states [1/s].
    """
    count, index = len(rates), par[_POLYTROPIC]
    gained = pressure ** (1.0 - 1.0 / index) * rates[count - AIR]
    if par[_HEAT_RATE] > 0.0:  # which changes the air state too
        gained = rates[count - AMBIENT]
    if par[_TUBE_RESISTANCE] > 0.0:
        gained += par[_TUBE_VOLUME] * rates[count - TUBE]
    return gained / (GAS_CONSTANT * par[_TEMPERATURE])


def flow_in(
    par: Row,
    before: Row,
    act: Row,
    at_valve: float,
    command: float,
    time: float,
    timestep: float,
) -> float:
    """Mass flow through the valves during a step [kg/s].

    Args:
        par: parameter row.
        before: states before the step.
        act: states after it.
        at_valve: absolute pressure at the valves before it [Pa].
        command: during it.
        time: before it [s].
        timestep: [s].
    """
    sent, gauge = command_at_valve(par, before, command), at_valve - par[_ATMOSPHERE]
    opening = reached_opening(par, before, sent, gauge, time, timestep)
    sag = 0.0
    if sags(par):  # the valves see the sag at the end of the step
        sag = act[len(act) - SAG] * (par[_SUPPLY] + par[_ATMOSPHERE])
    return flow_through_valves(par, at_valve, left_by_dead_zone(par, opening), sag)


def rounding_of_flow(par: Row, pressure: float, at_valve: float, timestep: float) -> float:
    """What rounding may add to the balance of air [kg/s]; see the top of this module.

    Args:
        par: parameter row.
        pressure: absolute, in the chamber [Pa].
        at_valve: absolute, at the valves [Pa].
        timestep: [s].
    """
    uncertain = _OPERATIONS * _ROUNDING
    if volume_varies(par):
        uncertain = _SEARCH
    upstream = max(pressure, at_valve, par[_SUPPLY] + par[_ATMOSPHERE])
    per_volume = GAS_CONSTANT * par[_TEMPERATURE]
    steep = 1.0 / (1.0 - par[_LAMINAR]) + upstream / par[_BAND]
    conductance = max(par[_FILL], par[_EXHAUST]) + par[_LEAK]
    through_gap = par[_LAMINAR_LEAK] * upstream / per_volume
    flow = 2.0 * upstream * (conductance * REFERENCE_DENSITY + through_gap)
    stored = 0.0
    if par[_TUBE_RESISTANCE] > 0.0:
        stored = par[_TUBE_VOLUME] * upstream / (per_volume * timestep)
    return uncertain * steep * flow + _OPERATIONS * _ROUNDING * stored
