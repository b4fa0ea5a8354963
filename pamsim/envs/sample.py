"""Readings, observation and reward of the environments at each sample.

One rig at a time and number by number, compiled: for a single rig numpy's calls would cost more
than the simulation, and the results of a rig do not depend on how many are stepped with it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.engine.jit import hand_to_numba, reached_functions
from pamsim.engine.rig import Rig
from pamsim.envs.episode import NOISE, TORQUE
from pamsim.envs.scales import LIMIT, ObservedSignals, Reach
from pamsim.envs.settings import EnvSettings
from pamsim.numba_cache import numba
from pamsim.physics.spline import curve_of_8
from pamsim.recordings.sensors import MeasurementChain

ERROR_SHARE = 0.25
"""Error of a joint's position, as a share of its travel, that counts as 1 in the reward."""

SUCCESS = 0.1
"""Error of every joint, in units of `ERROR_SHARE` of its travel, below which a step succeeds: a
fortieth of the travel, 0.5 deg on `mas20_arm`."""

BREAKDOWN = -100.0
"""Reward of the step in which a simulation breaks down."""

RUNAWAY = 100.0
"""Position beyond which a simulation has broken down [rad or m]."""

hand_to_numba(reached_functions(curve_of_8))  # which compiled steps of environments call


class Sampling(NamedTuple):
    """What turns s signals, positions of joints and then pressures, into readings and rewards."""

    centre: FloatArray  # (o,) of each number of an observation [SI]
    scale: FloatArray  # (o,) of each number of an observation [SI]
    unit: FloatArray  # (j,) error of each joint's position that counts as 1 [rad or m]
    span: float  # change of command that counts as 1
    effort: float  # weight of the mean squared change
    period: float  # between samples [s]
    noise: FloatArray  # (s,) standard deviations
    step: FloatArray  # (n, s) resolution; 0 for unlimited
    gain: FloatArray  # (n, s) reading per true change
    bend: FloatArray  # (n, s) half of the change of that per true change
    bias: FloatArray  # (n, s) reading at zero
    done: FloatArray  # (n, s) share of a jump that a lag makes up within a period; 1 without lag
    along: FloatArray  # (n, s) share of a change spread evenly over it
    slack: FloatArray  # (n, s) half of a coupling's backlash
    held: FloatArray  # (n, s) memory: signals behind their lags
    before: FloatArray  # (n, s) memory: signals behind their couplings at the last sample
    measured: FloatArray  # (n, s) memory: readings at the last sample
    commands: FloatArray  # (n, k, m) memory: of the step if delayed, and of the last k - 1 steps
    learned: FloatArray  # (n, 10) ends and control values of a further error of the positions

    def set_errors(self, number: int, rig: Rig, *, rounded: bool) -> None:
        """Give one rig's instruments the errors that its measurement chain states.

        They round only if ``rounded``. Errors of a log, its clock and its dead channels, are none
        of them: whatever acts on the readings has them as they come.
        """
        own, joints = rig.sensor or MeasurementChain(), len(rig.joints)
        for columns, kind in ((slice(joints), "angle"), (slice(joints, None), "pressure")):
            gain, bend, bias, lag = (
                getattr(own, f"{kind}_{name}") for name in ("scale", "bend", "bias", "lag")
            )
            ratio = self.period / lag if lag > 0.0 else math.inf
            done = -math.expm1(-ratio)
            self.gain[number, columns], self.bend[number, columns] = gain, bend
            self.bias[number, columns] = bias
            self.done[number, columns], self.along[number, columns] = done, 1.0 - done / ratio
        self.learned[number] = own.learned
        self.slack[number, :joints] = 0.5 * own.angle_backlash
        if rounded:
            turn = 2.0 * math.pi / own.encoder_increments if own.encoder_increments else 0.0
            # An encoder counts parts of a turn, so it reads joints which slide without rounding.
            self.step[number, :joints] = [turn * (kind == "angle") for kind in rig.joints.values()]
            self.step[number, joints:] = own.pressure_step


def new_sampling(
    settings: EnvSettings,
    rig: Rig,
    signals: ObservedSignals,
    reaches: Sequence[Reach],
    span: float,
    shape: tuple[int, int],
) -> Sampling:
    """Set up the sampling of n rigs that keep the commands of their last k steps; shape (n, k)."""
    muscles = len(rig.muscles)
    noise = [settings.angle_noise] * len(rig.joints) + [settings.pressure_noise] * muscles
    memory = np.zeros((10, shape[0], len(noise)))
    return Sampling(
        signals.centre,
        signals.scale,
        np.array([ERROR_SHARE * reach.travel for reach in reaches]),
        span,
        float(settings.effort),
        settings.frame_skip * float(rig.model.opt.timestep),
        np.array(noise, dtype=float),
        *memory,
        commands=np.zeros((*shape, muscles)),
        learned=np.zeros((shape[0], len(MeasurementChain().learned))),
    )


@numba.njit(cache=True, nogil=True, error_model="numpy")
def take_sample(s, rigs, first, true, command, table, at, observation, terms, broken):
    """Observations (n, o) of some rigs, terms of reward (n, 2), and which have broken down (n,).

    From true signals (n, s), commands (n, m) of the step, the episodes' tables and the numbers (n,)
    of the last samples, which are counted on; the memory of the `Sampling` is updated. At first the
    rigs are at rest, the commands are those that leave them there, and nothing has passed. Returns
    whether a table is at its last row.
    """
    joints, signals = s.unit.size, true.shape[1]
    velocity, seen = np.zeros(joints), np.empty(s.centre.size)
    for rig in rigs:
        asked = table[rig, at[rig]]
        if not first:
            at[rig] += 1
        following, shown = table[rig, at[rig]], s.measured[rig]
        error, fine = 0.0, True
        for column in range(signals):
            now = true[rig, column]
            if column < joints:
                fine &= abs(now) < RUNAWAY  # false for NaN
                error += abs(now - asked[column]) / s.unit[column]
            slack = s.slack[rig, column]
            if slack > 0.0 and not first:  # the play operator
                now = min(max(s.before[rig, column], now - slack), now + slack)
            held = now
            if not first and s.done[rig, column] < 1.0:
                # Exact for a signal that is straight between the samples.
                held, then = s.held[rig, column], s.before[rig, column]
                held += s.done[rig, column] * (then - held)
                held += s.along[rig, column] * (now - then)
            s.held[rig, column], s.before[rig, column] = held, now
            gain = s.gain[rig, column] + s.bend[rig, column] * held
            reading = gain * held + s.bias[rig, column]
            c = s.learned[rig]
            if column < joints and c[1] > c[0]:
                reading += curve_of_8(
                    held, c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8], c[9]
                )
            reading += s.noise[column] * following[NOISE * joints + column]
            step = s.step[rig, column]
            if step > 0.0:
                # An encoder counts whole increments, a converter rounds.
                steps = reading / step
                reading = (np.floor(steps) if column < joints else np.rint(steps)) * step
            if column < joints:
                velocity[column] = 0.0 if first else (reading - shown[column]) / s.period
            else:
                fine &= np.isfinite(now)
            shown[column] = reading
        moved = 0.0  # numbers, no arrays: making those takes as long as all else
        for muscle in range(command.shape[1]):
            change = (command[rig, muscle] - s.commands[rig, 1, muscle]) / s.span
            moved += change * change
        for muscle in range(command.shape[1]):
            s.commands[rig, 0, muscle] = command[rig, muscle]
            for old in range(s.commands.shape[1] - 1, 0, -1):
                s.commands[rig, old, muscle] = s.commands[rig, old - 1, muscle]
        terms[rig, 0], terms[rig, 1] = -error / joints, -s.effort * moved / command.shape[1]
        broken[rig] = not fine
        if not fine and not first:
            terms[rig, 0], terms[rig, 1] = BREAKDOWN, 0.0
            for column in range(signals):
                shown[column] = 0.0
            for joint in range(joints):
                velocity[joint] = 0.0
        for column in range(signals):
            place = column if column < joints else column + joints  # speeds follow the positions
            seen[place] = shown[column]
        for joint in range(joints):
            seen[joints + joint] = velocity[joint]
        for place in range(TORQUE * joints):
            seen[joints + signals + place] = following[place]
        for place in range(seen.size):
            scaled = (seen[place] - s.centre[place]) / s.scale[place]
            observation[rig, place] = np.minimum(np.maximum(scaled, -LIMIT), LIMIT)
    return at.max() + 1 >= table.shape[1]
