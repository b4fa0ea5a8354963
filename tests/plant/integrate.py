"""Integrate a plant: Runge-Kutta steps of order 4 between the instants at which its laws change.

Such instants are the arrival of a command, and, with friction that sticks, those at which the joint
comes to a stop or breaks loose. Both are located within a step, which is then taken in parts, so
that a joint that sticks does not move at all. Arguments are those of `sampled`.
"""

from __future__ import annotations

import math

import numpy as np

from pamsim.core.units import FloatArray
from tests.plant.joint import dry_level, sticks
from tests.plant.muscle import played, reach_of
from tests.plant.rates import all_tensions, driving_torque, muscle_length, write_rates
from tests.plant.records import (
    ANGLE,
    JOINT_STATES,
    MUSCLE_STATES,
    PLAYS,
    PRESSURE,
    SHIFT,
    SPEED,
    Record,
)

_SWITCHES = 8
"""Most parts of a step; a change between sticking and slipping takes two."""


def runge_kutta(
    j, muscles, plays, states, time, step, commands, by_pressure, direction, stuck, work
) -> None:
    """Write the states after a step into ``work[5]``."""
    count = len(states)
    for stage in range(4):
        share = 0.0 if stage == 0 else (step if stage == 3 else 0.5 * step)
        for i in range(count):
            slope = 0.0 if stage == 0 else work[stage - 1, i]
            work[4, i] = states[i] + share * slope
        write_rates(
            j, muscles, plays, work[4, :count], time + share, commands, by_pressure, direction,
            stuck, work[6:9, : len(muscles)], work[stage, :count],
        )  # fmt: skip
    for i in range(count):
        slope = work[0, i] + 2.0 * work[1, i] + 2.0 * work[2, i] + work[3, i]
        work[5, i] = states[i] + step / 6.0 * slope


def load_margin(j, muscles, plays, states, time, tensions) -> tuple[float, float]:
    """Torque that drives a joint at rest, and by how much it exceeds its friction [N m]."""
    all_tensions(muscles, plays, states, time, tensions)
    drive = driving_torque(j, muscles, states, tensions)
    return drive, abs(drive) - dry_level(j, 0.0, tensions.sum())


def keep(j, muscles, plays, states, new) -> None:
    """Accept the states after a step, and bring what has a memory up to date."""
    for i in range(len(states)):
        states[i] = new[i]
    if j.backlash > 0.0 and j.tooth_stiffness == 0.0:
        states[SHIFT] = min(max(states[SHIFT], -0.5 * j.backlash), 0.5 * j.backlash)
    for i in range(len(muscles)):
        m = muscles[i]
        if m.play_reach > 0.0:
            length = muscle_length(m, states, JOINT_STATES + i * MUSCLE_STATES)
            kappa = 1.0 - length / m.nominal_length
            for k in range(PLAYS):
                plays[i, k] = played(plays[i, k], kappa, reach_of(m, k))


def advance(j, muscles, plays, states, time, step, commands, by_pressure, direction, work) -> float:
    """Take a step, in parts where the joint sticks or breaks loose.

    Returns:
        The direction in which the joint slips after it, 0 if it sticks; 0 without such friction.
    """
    new = work[5, : len(states)]
    tensions = work[6, : len(muscles)]
    dry = sticks(j)
    left, part, before, located = step, step, 0.0, False
    for switch in range(_SWITCHES):
        stuck = dry and direction == 0.0
        if dry and not located:
            before = direction * states[SPEED]
            if stuck:
                before = -load_margin(j, muscles, plays, states, time, tensions)[1]
        runge_kutta(
            j, muscles, plays, states, time, part, commands, by_pressure, direction, stuck, work
        )
        if dry and not located and switch < _SWITCHES - 2:
            # Both quantities fall below 0 at a change, and are smooth up to there.
            after = direction * new[SPEED]
            if stuck:
                after = -load_margin(j, muscles, plays, new, time + part, tensions)[1]
            if after < 0.0:
                part *= max(before, 0.0) / (max(before, 0.0) - after)
                located = True
                continue
        keep(j, muscles, plays, states, new)
        if not located:
            break
        states[SPEED] = 0.0
        time += part
        left -= part
        drive, above = load_margin(j, muscles, plays, states, time, tensions)
        direction = math.copysign(1.0, drive) if stuck or above > 0.0 else 0.0
        part, located = left, False
    return direction


def sampled(
    j: Record,
    muscles: Record,
    plays: FloatArray,
    states: FloatArray,
    times: FloatArray,
    arrivals: FloatArray,
    by_pressure: bool,
    commands: FloatArray,
    longest: float,
    rows: FloatArray,
) -> None:
    """Integrate over a trial and write a row per sample.

    Args:
        j: numbers of the joint.
        muscles: (m,) numbers of the muscles.
        plays: (m, PLAYS) positions of the play operators, updated.
        states: of the plant at the first sample, updated.
        times: (n,) of the samples [s].
        arrivals: (k, 3) time [s], muscle and value of each change of command, sorted by time.
        by_pressure: whether commands are set points.
        commands: (m,) before the first change, updated.
        longest: step [s].
        rows: (n, 2 + 2 m) written: angle [rad], speed [rad/s], absolute pressures [Pa], tensions
            [N].
    """
    count = len(muscles)
    work = np.zeros((9, len(states)))
    tensions = np.zeros(count)
    # A joint that moves goes on: a trial and the pieces of a settling begin where another ended.
    direction, coming = 0.0, 0
    if states[SPEED] != 0.0:
        direction = math.copysign(1.0, states[SPEED])
    for sample in range(len(times)):
        now = times[sample]
        all_tensions(muscles, plays, states, now, tensions)
        rows[sample, 0] = states[ANGLE]
        rows[sample, 1] = states[SPEED]
        for i in range(count):
            rows[sample, 2 + i] = states[JOINT_STATES + i * MUSCLE_STATES + PRESSURE]
            rows[sample, 2 + count + i] = tensions[i]
        if sample == len(times) - 1:
            break
        until = times[sample + 1]
        while now < until - 1e-12:
            while coming < len(arrivals) and arrivals[coming, 0] <= now + 1e-12:
                commands[int(arrivals[coming, 1])] = arrivals[coming, 2]
                coming += 1
            end = until
            if coming < len(arrivals) and arrivals[coming, 0] < until - 1e-12:
                end = arrivals[coming, 0]
            steps = max(math.ceil((end - now) / longest - 1e-9), 1)
            step = (end - now) / steps
            for k in range(steps):
                at = now + k * step
                direction = advance(
                    j, muscles, plays, states, at, step, commands, by_pressure, direction, work
                )
            now = end
