"""Readings, observation and reward of the environments at each sample.

One rig at a time and number by number, compiled: for a single rig numpy's calls would cost more
than the simulation, and the results of a rig do not depend on how many are stepped with it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from pamsim.engine.rig import Rig
from pamsim.envs.episode import NOISE
from pamsim.envs.scales import LIMIT, ObservedSignals
from pamsim.envs.settings import EnvSettings
from pamsim.recordings.sensors import MeasurementChain

FloatArray = NDArray[np.float64]

BREAKDOWN = -100.0
"""Reward of the step in which a simulation breaks down."""

RUNAWAY = 100.0
"""Position beyond which a simulation has broken down [rad or m]."""


class Sampling(NamedTuple):
    """What turns signals of n rigs into readings, observations (o,) and rewards.

    The s signals are positions of joints [rad or m], then pressures [Pa].

    Attributes:
        centre: (o,) of each number of an observation [SI].
        scale: (o,) of each number of an observation [SI].
        unit: (j,) error of each joint's position that counts as 1 [rad or m].
        span: change of command that counts as 1.
        effort: weight of the mean squared change.
        period: between samples [s].
        noise: (s,) standard deviations.
        step: (s,) resolution; 0 for unlimited.
        gain: (n, s) reading per true change.
        bias: (n, s) reading at zero.
        done: (n, s) share of a jump that a lag makes up within a period; 1 without lag.
        along: (n, s) share of a change spread evenly over it.
        held: (n, s) memory: signals behind their lags.
        before: (n, s) memory: true signals of the last sample.
        measured: (n, s) memory: readings at the last sample.
        commands: (n, k, m) memory: commands of the last k steps, the latest first.
    """

    centre: FloatArray
    scale: FloatArray
    unit: FloatArray
    span: float
    effort: float
    period: float
    noise: FloatArray
    step: FloatArray
    gain: FloatArray
    bias: FloatArray
    done: FloatArray
    along: FloatArray
    held: FloatArray
    before: FloatArray
    measured: FloatArray
    commands: FloatArray

    @classmethod
    def of(
        cls,
        settings: EnvSettings,
        rig: Rig,
        signals: ObservedSignals,
        unit: FloatArray,
        span: float,
        period: float,
        shape: tuple[int, int],
    ) -> Sampling:
        """Those of ``shape[0]`` rigs which remember ``shape[1]`` commands."""
        own = rig.sensor or MeasurementChain()
        count, muscles = shape[0], len(rig.muscles)
        turn, converter = 0.0, 0.0
        if settings.instruments:
            converter = own.pressure_step
            if own.encoder_increments:
                turn = 2.0 * math.pi / own.encoder_increments
        # An encoder counts parts of a turn, so it reads joints which slide without rounding.
        steps = [turn * (kind == "angle") for kind in rig.joints.values()] + [converter] * muscles
        noise = [settings.angle_noise] * len(rig.joints) + [settings.pressure_noise] * muscles
        return cls(
            signals.centre,
            signals.scale,
            unit,
            span,
            float(settings.effort),
            period,
            np.array(noise, dtype=float),
            np.array(steps),
            *np.zeros((7, count, len(steps))),
            np.zeros((*shape, muscles)),
        )

    def set_errors(self, number: int, rig: Rig) -> None:
        """Give one rig's instruments the scale, bias and lag that its measurement chain states."""
        own = rig.sensor or MeasurementChain()
        joints = slice(len(rig.joints))
        pressures = slice(joints.stop, None)
        for columns, gain, bias, lag in (
            (joints, own.angle_scale, own.angle_bias, own.angle_lag),
            (pressures, own.pressure_scale, own.pressure_bias, own.pressure_lag),
        ):
            ratio = self.period / lag if lag > 0.0 else math.inf
            done = -math.expm1(-ratio)
            self.gain[number, columns] = gain
            self.bias[number, columns] = bias
            self.done[number, columns] = done
            self.along[number, columns] = 1.0 - done / ratio


@numba.njit(cache=True, nogil=True, error_model="numpy")
def take_sample(s, rigs, first, true, command, table, at, observation):
    """Observations of some rigs, and their rewards for the period that has passed.

    Args:
        s: `Sampling`; its memory is updated.
        rigs: (k,) their numbers.
        first: whether their episodes begin: they are at rest, and nothing has passed.
        true: (n, s) signals [SI].
        command: (n, m) of the step; at first, that which leaves the muscles at rest.
        table: (n, rows, columns) of the episodes.
        at: (n,) number of the last sample, one more afterwards unless it is the first.
        observation: (n, o) written.

    Returns:
        Rewards (n,), and whether the simulation of a rig has broken down (n,).
    """
    joints, signals, muscles = s.unit.size, true.shape[1], command.shape[1]
    velocity = np.zeros(joints)
    reward, broken = np.zeros(at.size), np.zeros(at.size, dtype=np.bool_)
    for rig in rigs:
        asked = table[rig, at[rig]]
        if not first:
            at[rig] += 1
        following = table[rig, at[rig]]
        error, effort = 0.0, 0.0
        for column in range(signals):
            now = held = true[rig, column]
            if not first and s.done[rig, column] < 1.0:
                # Exact for a signal that is straight between the samples.
                held, then = s.held[rig, column], s.before[rig, column]
                held += s.done[rig, column] * (then - held)
                held += s.along[rig, column] * (now - then)
            s.held[rig, column], s.before[rig, column] = held, now
            shown = s.gain[rig, column] * held + s.bias[rig, column]
            shown += s.noise[column] * following[NOISE * joints + column]
            step = s.step[column]
            if step > 0.0:
                # An encoder counts whole increments, a converter rounds.
                shown = (
                    np.floor(shown / step) if column < joints else np.rint(shown / step)
                ) * step
            if column < joints:
                broken[rig] |= not abs(now) < RUNAWAY  # true for NaN
                error += abs(now - asked[column]) / s.unit[column]
                velocity[column] = (shown - s.measured[rig, column]) / s.period
            else:
                broken[rig] |= not np.isfinite(now)
            s.measured[rig, column] = shown
        for muscle in range(muscles):
            change = (command[rig, muscle] - s.commands[rig, 0, muscle]) / s.span
            effort += change * change
            for old in range(s.commands.shape[1] - 1, -1, -1):
                newer = (
                    command[rig, muscle] if first or not old else s.commands[rig, old - 1, muscle]
                )
                s.commands[rig, old, muscle] = newer
        reward[rig] = -error / joints - s.effort * effort / muscles
        if first:
            broken[rig], velocity[:] = False, 0.0
        elif broken[rig]:
            reward[rig], velocity[:], s.measured[rig, :] = BREAKDOWN, 0.0, 0.0
        for place in range(s.centre.size):
            if place < joints:
                seen = s.measured[rig, place]
            elif place < 2 * joints:
                seen = velocity[place - joints]
            elif place < joints + signals:
                seen = s.measured[rig, place - joints]
            else:
                seen = following[place - joints - signals]
            seen = (seen - s.centre[place]) / s.scale[place]
            observation[rig, place] = min(max(seen, -LIMIT), LIMIT)
    return reward, broken
