"""States of a muscle at rest: the start of a run, and of a run that has settled."""

from __future__ import annotations

from pamsim.physics.chain import chain_length
from pamsim.physics.chamber import air_state
from pamsim.physics.chamber_pressure import chamber_volume
from pamsim.physics.hysteresis.maxwell_slip import BLOCKS
from pamsim.physics.record import STATE_NAMES, Parameters, Row, States, joined_states, split_states
from pamsim.physics.static_muscle import contraction, length_at_muscle
from pamsim.physics.valves import MEASURED, PRESSURE_SET


def charged_air_state(m: Parameters, z: Row, tendon_length: float, pressure: float) -> float:
    """Air state y that gives a gauge pressure [Pa] at a tendon length at the muscle [m]."""
    inside = chamber_volume(m, z, tendon_length, pressure)
    return air_state(m.chamber, pressure + m.chamber.atmosphere, inside)


def rest(m: Parameters, count: int, tendon_length: float, pressure: float) -> list[float]:
    """The ``act`` (count,) of a muscle that has long been at rest at a gauge pressure [Pa].

    The operators are free of memory, the chain is free of force and in the middle of its backlash,
    the creep relaxed, the command's line at what keeps the valves shut, the tube at the chamber's
    pressure, the air at the ambient temperature.
    """
    length = chain_length(m.chain, tendon_length)
    kappa, pressure_abs = contraction(m, length), pressure + m.chamber.atmosphere
    z = [0.0] * (count - len(STATE_NAMES) - BLOCKS) + [kappa] * BLOCKS
    s = split_states([0.0] * count)[0]
    s.air = charged_air_state(m, z, length, pressure)
    s.tube_pressure = s.last_pressure = s.earlier_pressure = pressure_abs
    s.ambient_air = pressure_abs * chamber_volume(m, z, length, pressure)
    quieten(m, s, tendon_length, pressure)
    return joined_states(s, z)


def quieten(m: Parameters, s: States, tendon_length: float, pressure: float) -> None:
    """Relax the creep, and set line or pressure to what keeps the valves shut, or is measured.

    First stroke and softening are to come. At a tendon length [m] and a gauge pressure [Pa].
    """
    kappa = contraction(m, length_at_muscle(m, s, tendon_length))
    s.creep = s.creep_2 = kappa
    s.softened = 0.0
    if m.first_stroke.force > 0.0:
        s.furthest = kappa + m.first_stroke.travel
    s.line = pressure if m.command == PRESSURE_SET else 0.0
    if m.command == MEASURED:
        s.air = pressure + m.chamber.atmosphere
