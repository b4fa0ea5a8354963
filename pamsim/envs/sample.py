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
from pamsim.envs.episode import NOISE, TORQUE
from pamsim.envs.scales import LIMIT
from pamsim.envs.settings import EnvSettings
from pamsim.recordings.sensors import MeasurementChain

FloatArray = NDArray[np.float64]

ERROR_SHARE = 0.25
"""Error of a joint's position, as a share of its travel, that counts as 1 in the reward."""

BREAKDOWN = -100.0
"""Reward of the step in which a simulation breaks down."""

RUNAWAY = 100.0
"""Position beyond which a simulation has broken down [rad or m]."""


class Rules(NamedTuple):
    """What turns signals into observations and rewards.

    Attributes:
        centre: (o,) of each number of an observation [SI].
        scale: (o,) of each number of an observation [SI].
        unit: (j,) error of each joint's position that counts as 1 [rad or m].
        span: change of command that counts as 1.
        effort: weight of the mean squared change.
        period: between samples [s].
    """

    centre: FloatArray
    scale: FloatArray
    unit: FloatArray
    span: float
    effort: float
    period: float


class Gauge(NamedTuple):
    """Encoders and pressure transducers; columns are positions of joints, then pressures.

    Attributes:
        scale: (n, s) reading per true change.
        bias: (n, s) reading at zero [rad or m, Pa].
        done: (n, s) share of a jump that a lag makes up within a period; 1 without lag.
        along: (n, s) share of a change spread evenly over it.
        noise: (s,) standard deviations.
        step: (s,) resolution; 0 for unlimited.
        held: (n, s) memory: signals behind their lags.
        before: (n, s) memory: true signals of the last sample.
    """

    scale: FloatArray
    bias: FloatArray
    done: FloatArray
    along: FloatArray
    noise: FloatArray
    step: FloatArray
    held: FloatArray
    before: FloatArray


def instruments(settings: EnvSettings, rig: Rig, rigs: int) -> Gauge:
    """Instruments of a number of rigs.

    Args:
        settings: noise, and whether encoders and converters round.
        rig: of the environment; an encoder counts parts of a turn, so that it reads joints which
            slide without rounding.
        rigs: how many.
    """
    own = rig.sensor or MeasurementChain()
    increments = own.encoder_increments if settings.instruments else 0.0
    converter = own.pressure_step if settings.instruments else 0.0
    turn = 2.0 * math.pi / increments if increments else 0.0
    muscles = len(rig.muscles)
    steps = [turn if kind == "angle" else 0.0 for kind in rig.joints.values()]
    noise = [settings.angle_noise] * len(steps) + [settings.pressure_noise] * muscles
    size = rigs, len(noise)
    return Gauge(
        scale=np.ones(size),
        bias=np.zeros(size),
        done=np.ones(size),
        along=np.ones(size),
        noise=np.array(noise),
        step=np.array(steps + [converter] * muscles),
        held=np.zeros(size),
        before=np.zeros(size),
    )


def set_errors(gauge: Gauge, number: int, rig: Rig, period: float) -> None:
    """Give one rig's instruments their scale, bias and lag.

    Args:
        gauge: changed in place.
        number: of the rig.
        rig: whose measurement chain states what they err by.
        period: between samples [s].
    """
    own = rig.sensor or MeasurementChain()
    joints = len(rig.joints)
    for columns, scale, bias, lag in (
        (slice(joints), own.angle_scale, own.angle_bias, own.angle_lag),
        (slice(joints, None), own.pressure_scale, own.pressure_bias, own.pressure_lag),
    ):
        gauge.scale[number, columns] = scale
        gauge.bias[number, columns] = bias
        ratio = period / lag if lag > 0.0 else math.inf
        done = -math.expm1(-ratio)
        gauge.done[number, columns] = done
        gauge.along[number, columns] = 1.0 - done / ratio


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _shown(signal, rig, column, joints, gauge, draws):
    """Reading of encoder or transducer, from the signal after its lag."""
    shown = gauge.scale[rig, column] * signal + gauge.bias[rig, column]
    shown += gauge.noise[column] * draws[NOISE * joints + column]
    step = gauge.step[column]
    if step > 0.0:
        # An encoder counts whole increments, a converter rounds.
        shown = (np.floor(shown / step) if column < joints else np.rint(shown / step)) * step
    return shown


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _observe(measured, velocity, asked, rules, observation):
    joints, signals = velocity.size, measured.size
    for place in range(observation.size):
        if place < joints:
            seen = measured[place]
        elif place < 2 * joints:
            seen = velocity[place - joints]
        elif place < joints + signals:
            seen = measured[place - joints]
        else:
            seen = asked[place - joints - signals]
        seen = (seen - rules.centre[place]) / rules.scale[place]
        observation[place] = min(max(seen, -LIMIT), LIMIT)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def first_sample(new, true, gauge, measured, table, rules, observation):
    """First observation of an episode, which begins at rest.

    Args:
        new: (n,) of bool: which rigs begin an episode.
        true: (n, j + m) positions [rad or m] and pressures [Pa].
        gauge: `Gauge`; its memory is set.
        measured: (n, j + m) written: readings of the instruments.
        table: (n, rows, columns) of the episodes.
        rules: see `Rules`.
        observation: (n, o) written.
    """
    joints = rules.unit.size
    still = np.zeros(joints)
    for rig in range(new.size):
        if new[rig]:
            first = table[rig, 0]
            for column in range(true.shape[1]):
                now = true[rig, column]
                gauge.before[rig, column] = gauge.held[rig, column] = now
                measured[rig, column] = _shown(now, rig, column, joints, gauge, first)
            _observe(measured[rig], still, first, rules, observation[rig])


@numba.njit(cache=True, nogil=True, error_model="numpy")
def next_sample(
    true, gauge, measured, table, sample, command, last, rules, observation, reward, broken
):
    """Observation and reward after one period.

    Args:
        true: (n, j + m) positions [rad or m] and pressures [Pa].
        gauge: `Gauge`; its memory is updated.
        measured: (n, j + m) readings at the last sample, overwritten by the present ones.
        table: (n, rows, columns) of the episodes.
        sample: (n,) number of the sample, one more afterwards.
        command: (n, m) of the step.
        last: (n, m) of the step before, and now of this one.
        rules: see `Rules`.
        observation: (n, o) written.
        reward: (n,) written.
        broken: (n,) written: whether the simulation of a rig has broken down.
    """
    joints, muscles = rules.unit.size, command.shape[1]
    velocity = np.empty(joints)
    for rig in range(sample.size):
        asked = table[rig, sample[rig]]
        sample[rig] += 1
        following = table[rig, sample[rig]]
        error, fine = 0.0, True
        for column in range(joints + muscles):
            now = true[rig, column]
            if gauge.done[rig, column] < 1.0:
                # Exact for a signal that is straight between the samples.
                held, then = gauge.held[rig, column], gauge.before[rig, column]
                held += gauge.done[rig, column] * (then - held)
                held += gauge.along[rig, column] * (now - then)
            else:
                held = now
            gauge.held[rig, column] = held
            gauge.before[rig, column] = now
            shown = _shown(held, rig, column, joints, gauge, following)
            if column < joints:
                fine = fine and abs(now) < RUNAWAY  # false for NaN
                error += abs(now - asked[column]) / rules.unit[column]
                velocity[column] = (shown - measured[rig, column]) / rules.period
            else:
                fine = fine and np.isfinite(now)
            measured[rig, column] = shown
        effort = 0.0
        for muscle in range(muscles):
            change = (command[rig, muscle] - last[rig, muscle]) / rules.span
            effort += change * change
            last[rig, muscle] = command[rig, muscle]
        reward[rig] = -error / joints - rules.effort * effort / muscles
        broken[rig] = not fine
        if broken[rig]:
            reward[rig] = BREAKDOWN
            velocity[:] = 0.0
            measured[rig, :] = 0.0
        _observe(measured[rig], velocity, following[: TORQUE * joints], rules, observation[rig])
