"""The equations of a plant put together: from states to rates and torques."""

from __future__ import annotations

import math

from pamsim.core.units import FloatArray
from tests.plant.air import R_AIR, flows, line_pressure, opening, pressure_rate, refilled
from tests.plant.joint import bristle_rate, dry_level, free_torque
from tests.plant.muscle import duhem_rate, loop_rate, rub_rate, tension, volume
from tests.plant.records import (
    AIR_TEMPERATURE,
    ANGLE,
    BRANCHES,
    BRISTLE,
    DUHEM,
    JOINT_STATES,
    LINE,
    LOOP,
    MUSCLE_STATES,
    PRESSURE,
    RESERVOIR,
    RUB,
    SECOND_LINE,
    SHIFT,
    SPEED,
    STRAIN,
    STRETCH,
    Record,
)

_SLEW_TIME = 2e-3
"""Time constant of a slewing line close to its command [s]."""


def on_teeth(m: Record, angle: float) -> tuple[float, float]:
    """Tendon length behind cam and teeth [m], and its change with the angle [m/rad]."""
    travel, arm = m.arm * angle, m.arm
    if m.cam != 0.0:
        away, wide = (angle - m.cam_at) / m.cam_width, math.sqrt(2.0)
        swept = math.erf(away / wide) + math.erf(m.cam_at / m.cam_width / wide)
        travel += m.arm * m.cam * m.cam_width * math.sqrt(0.5 * math.pi) * swept
        arm += m.arm * m.cam * math.exp(-0.5 * away * away)
    if m.teeth == 0.0:
        return travel, arm
    wave = 2.0 * math.pi / m.teeth_pitch
    phase = wave * travel + m.teeth_phase
    return travel + m.teeth * math.sin(phase), arm * (1.0 + m.teeth * wave * math.cos(phase))


def muscle_length(m: Record, states: FloatArray, first: int) -> float:
    """Length of a muscle [m]: of its tendon, with the chain's shift and extension."""
    length = m.length_at_zero + on_teeth(m, states[ANGLE])[0] - states[first + STRETCH]
    return length + math.copysign(states[SHIFT], -m.arm * states[SHIFT])


def all_tensions(muscles, plays, states, time, tensions) -> None:
    """Write the tensions of all muscles [N]."""
    for i in range(len(muscles)):
        first = JOINT_STATES + i * MUSCLE_STATES
        length = muscle_length(muscles[i], states, first)
        speed = on_teeth(muscles[i], states[ANGLE])[1] * states[SPEED]
        tensions[i] = tension(muscles[i], plays[i], states, first, length, speed, time)


def driving_torque(j, muscles, states, tensions) -> float:
    """Torque on the joint of all but the friction that sticks [N m]."""
    total = free_torque(j, states[ANGLE], states[SPEED], states[BRISTLE])
    for i in range(len(muscles)):
        m = muscles[i]
        total -= on_teeth(m, states[ANGLE])[1] * tensions[i]
        if m.brake > 0.0:
            share = m.arm * states[SPEED] / m.brake_speed
            total -= m.arm * m.brake * share * math.exp((1.0 - share**2) / 2.0)
        if m.rub_travel > 0.0:
            force = states[JOINT_STATES + i * MUSCLE_STATES + RUB]
            rate = rub_rate(m, force, m.arm * states[SPEED], tensions[i])
            total -= m.arm * (force + m.rub_time * rate)
    return total


def shift_rate(j: Record, muscles: Record, shift: float, tensions: FloatArray) -> float:
    """Rate at which the chain slides on the sprocket [m/s]."""
    pull = 0.0
    for i in range(len(muscles)):
        pull += math.copysign(tensions[i], muscles[i].arm)
    if j.tooth_stiffness > 0.0:
        beyond = max(abs(shift) - 0.5 * j.backlash, 0.0)
        stiffness = j.tooth_stiffness
        if j.tooth_bend > 0.0:
            stiffness *= math.sqrt(beyond / j.tooth_bend)  # contact of Hertz
        pull -= math.copysign(stiffness * beyond, shift)
    elif abs(shift) >= 0.5 * j.backlash and pull * shift > 0.0:
        return 0.0
    return pull / j.shift_damping


def write_rates(
    j, muscles, plays, states, time, commands, by_pressure, direction, stuck, work, rates
) -> None:
    """Write the rates of all states [1/s], of commands that have arrived.

    The joint sticks, or slips in a direction against friction that sticks, 0 without any; ``work``
    is overwritten: (3, m) tensions [N], openings [-], absolute pressures [Pa].
    """
    tensions, openings, pressures = work[0], work[1], work[2]
    all_tensions(muscles, plays, states, time, tensions)
    speed = 0.0 if stuck else states[SPEED]
    rates[ANGLE] = speed
    rates[SPEED] = 0.0
    if not stuck:
        braked = direction * dry_level(j, speed, tensions.sum()) if direction != 0.0 else 0.0
        rates[SPEED] = (driving_torque(j, muscles, states, tensions) - braked) / j.inertia
    rates[BRISTLE] = bristle_rate(j, states[BRISTLE], speed) if j.bristle > 0.0 else 0.0
    rates[SHIFT] = shift_rate(j, muscles, states[SHIFT], tensions) if j.backlash > 0.0 else 0.0
    for i in range(len(muscles)):
        m, first = muscles[i], JOINT_STATES + i * MUSCLE_STATES
        pressures[i] = states[first + PRESSURE]
        arrived = line_rates(m, states, rates, first, commands[i])
        openings[i] = opening(m, arrived, by_pressure, pressures[i] - m.atmosphere, time)
    line = states[RESERVOIR]
    if j.refill + j.refill_square > 0.0 and j.reservoir == 0.0:
        line = line_pressure(j, muscles, openings, pressures)
    drawn = 0.0
    for i in range(len(muscles)):
        m, first = muscles[i], JOINT_STATES + i * MUSCLE_STATES
        inside = pressures[i]
        lengthening = on_teeth(m, states[ANGLE])[1] * speed
        lengthening += math.copysign(rates[SHIFT], -m.arm * rates[SHIFT])
        rates[first + STRETCH] = 0.0
        if m.compliance > 0.0:
            give = m.compliance * tensions[i]
            if m.hardening > 0.0:
                give *= 2.0 / (1.0 + tensions[i] / m.hardening)
            rates[first + STRETCH] = (give - states[first + STRETCH]) / m.compliance_time
            lengthening -= rates[first + STRETCH]
        shortening = -lengthening / m.nominal_length
        rates[first + LOOP] = loop_rate(m, states[first + LOOP], shortening)
        rates[first + DUHEM] = 0.0
        if m.duhem_per_pressure > 0.0:
            rates[first + DUHEM] = duhem_rate(m, states[first + DUHEM], shortening)
        rates[first + RUB] = 0.0
        if m.rub_travel > 0.0:
            rates[first + RUB] = rub_rate(m, states[first + RUB], m.arm * speed, tensions[i])
        branch_rates(m, states, rates, first, shortening)
        supply = line if j.refill + j.refill_square > 0.0 else m.supply + m.atmosphere
        into, out = flows(m, openings[i], inside, supply)
        drawn += into
        if j.cross > 0.0 and i < 2:
            other = JOINT_STATES + (1 - i) * MUSCLE_STATES
            out += j.cross * (inside - states[other + PRESSURE])
        length = muscle_length(m, states, first)
        space, per_length, softness = volume(m, length, inside - m.atmosphere)
        # The energy that the loop holds grows with pressure, and takes its volume from the air.
        held = m.loop_per_pressure * m.nominal_length * m.loop_yield * states[first + LOOP]
        space -= 0.5 * held * states[first + LOOP]
        swept = per_length * lengthening - held * rates[first + LOOP]
        warmth = states[first + AIR_TEMPERATURE]
        rates[first + PRESSURE], rates[first + AIR_TEMPERATURE] = pressure_rate(
            m, inside, (space, softness), swept, warmth, into, out
        )
    rates[RESERVOIR] = 0.0
    if j.reservoir > 0.0:
        m = muscles[0]
        given = refilled(j, m.supply + m.atmosphere - line)
        rates[RESERVOIR] = R_AIR * m.temperature / j.reservoir * (given - drawn)


def branch_rates(m, states, rates, first, shortening) -> None:
    """Write the rates of the strains of the relaxing branches [1/s]."""
    at = first + STRAIN
    for k in range(BRANCHES):
        rates[at + k] = 0.0
    if m.creep_0 > 0.0:
        rates[at] = shortening - states[at] / m.creep_time_0
    if m.creep_1 > 0.0:
        rates[at + 1] = shortening - states[at + 1] / m.creep_time_1
        rates[at + 2] = shortening - states[at + 2] / m.creep_time_2
        rates[at + 3] = shortening - states[at + 3] / m.creep_time_3
        rates[at + 4] = shortening - states[at + 4] / m.creep_time_4


def line_rates(m, states, rates, first, command) -> float:
    """Write the rates of the command's line and return what arrives at the valves."""
    rates[first + LINE] = 0.0
    rates[first + SECOND_LINE] = 0.0
    arrived = command
    if m.slew > 0.0:
        most = m.slew * m.slew_scale
        arrived = states[first + LINE]
        rates[first + LINE] = min(max((command - arrived) / _SLEW_TIME, -most), most)
    elif m.lag > 0.0:
        arrived = states[first + LINE]
        rates[first + LINE] = (command - arrived) / m.lag
        if m.second_lag > 0.0:
            rates[first + SECOND_LINE] = (arrived - states[first + SECOND_LINE]) / m.second_lag
            arrived = states[first + SECOND_LINE]
    return arrived
