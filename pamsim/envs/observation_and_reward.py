"""Observation and reward of the environments at each sample.

One arm at a time and number by number, compiled: for a single arm numpy's calls would cost more
than the simulation, and the results of an arm do not depend on how many are stepped with it.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from pamsim.envs.episode import ACCELERATION, ANGLE, NOISE, RATE, STIFFNESS

ANGLE_UNIT = math.radians(5.0)
"""Error of the angle that lowers the reward by 1 [rad]."""

BREAKDOWN = -100.0
"""Reward of the step in which a simulation breaks down."""

RUNAWAY = 100.0
"""Angle beyond which a simulation has broken down [rad]."""


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _shown(signal, arm, column, gauge, draws):
    """Reading of encoder or transducer, from the signal after its lag."""
    shown = gauge.scale[arm, column] * signal + gauge.bias[arm, column]
    shown += gauge.noise[column] * draws[NOISE + column]
    step = gauge.step[column]
    if step > 0.0:
        # An encoder counts whole increments, a converter rounds.
        shown = (np.floor(shown / step) if column == 0 else np.rint(shown / step)) * step
    return shown


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _observe(arm, measured, velocity, asked, supply, observation):
    observation[arm, 0] = measured[arm, 0]
    observation[arm, 1] = velocity
    observation[arm, 2] = measured[arm, 1] / supply
    observation[arm, 3] = measured[arm, 2] / supply
    observation[arm, 4] = asked[ANGLE]
    observation[arm, 5] = asked[RATE]
    observation[arm, 6] = asked[ACCELERATION]
    observation[arm, 7] = asked[STIFFNESS]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def first_sample(new, true, gauge, measured, table, supply, observation):
    """First observation of an episode, which begins at rest.

    Args:
        new: (n,) of bool: which arms begin an episode.
        true: (n, 3) angle [rad] and pressures [Pa].
        gauge: `pamsim.envs.instruments.Gauge`; its memory is set.
        measured: (n, 3) written: readings of the instruments.
        table: (n, samples + 1, columns) of the episodes.
        supply: [Pa].
        observation: (n, 8) written.
    """
    for arm in range(new.size):
        if new[arm]:
            for column in range(3):
                gauge.before[arm, column] = gauge.held[arm, column] = true[arm, column]
                measured[arm, column] = _shown(true[arm, column], arm, column, gauge, table[arm, 0])
            _observe(arm, measured, 0.0, table[arm, 0], supply, observation)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def next_sample(
    true,
    gauge,
    measured,
    table,
    sample,
    command,
    last,
    span,
    effort,
    period,
    supply,
    observation,
    reward,
    broken,
):
    """Observation and reward after one period.

    Args:
        true: (n, 3) angle [rad] and pressures [Pa].
        gauge: `pamsim.envs.instruments.Gauge`; its memory is updated.
        measured: (n, 3) readings at the last sample, overwritten by the present ones.
        table: (n, samples + 1, columns) of the episodes.
        sample: (n,) number of the sample, one more afterwards.
        command: (n, 2) of the step.
        last: (n, 2) of the step before, and now of this one.
        span: change of command that counts as 1.
        effort: weight of the squared change.
        period: [s].
        supply: [Pa].
        observation: (n, 8) written.
        reward: (n,) written.
        broken: (n,) written: whether the simulation of an arm has broken down.
    """
    for arm in range(sample.size):
        asked = table[arm, sample[arm], ANGLE]
        sample[arm] += 1
        following = table[arm, sample[arm]]
        angle = measured[arm, 0]
        for column in range(3):
            now = true[arm, column]
            if gauge.done[arm, column] < 1.0:
                # Exact for a signal that is straight between the samples.
                held, then = gauge.held[arm, column], gauge.before[arm, column]
                held += gauge.done[arm, column] * (then - held)
                held += gauge.along[arm, column] * (now - then)
            else:
                held = now
            gauge.held[arm, column] = held
            gauge.before[arm, column] = now
            measured[arm, column] = _shown(held, arm, column, gauge, following)
        velocity = (measured[arm, 0] - angle) / period
        error = abs(true[arm, 0] - asked) / ANGLE_UNIT
        reward[arm] = -error
        for muscle in range(2):
            change = (command[arm, muscle] - last[arm, muscle]) / span
            reward[arm] -= effort * change * change
            last[arm, muscle] = command[arm, muscle]
        broken[arm] = not (abs(true[arm, 0]) < RUNAWAY)  # NaN included
        if broken[arm]:
            reward[arm] = BREAKDOWN
            velocity = 0.0
            measured[arm, :] = 0.0
        _observe(arm, measured, velocity, following, supply, observation)
