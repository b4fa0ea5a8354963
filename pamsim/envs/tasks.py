"""What a joint may be asked to do: references for position and stiffness, torques that disturb it.

A task is drawn at the beginning of an episode, for each joint from a random generator of its own. A
longer episode begins as a shorter one with the same generator.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TypeAlias

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.envs.scales import Reach

STEP_EVERY = 2.0
"""Time between two steps of a reference [s]."""

SINE_HZ = (0.2, 1.0)
"""Frequencies a sine is drawn from [Hz], evenly on a logarithmic scale."""

MULTISINE_HZ = (0.1, 0.3, 0.5, 0.7, 1.1)
"""Tones of the multisine [Hz]."""


@dataclass(frozen=True, kw_only=True)
class TaskSignals:
    """What an episode asks of a joint, at each of its samples.

    Attributes:
        position: (n,) [rad or m].
        velocity: (n,) of that position [per s]; 0 where it jumps.
        acceleration: (n,) [per s^2].
        stiffness: (n,) of the joint [N m/rad or N/m]; 0 where the task leaves it free.
        torque: (n,) on the joint from outside [N m or N].
    """

    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    stiffness: FloatArray
    torque: FloatArray


Task: TypeAlias = Callable[[np.random.Generator, FloatArray, Reach], "TaskSignals | FloatArray"]
"""What an episode asks of a joint: random generator of its own, times (n,) [s] and reach -> its
signals, or positions (n,) alone, whose differences are then velocity and acceleration."""


def task_signals(
    task: Task, rng: np.random.Generator, time: FloatArray, reach: Reach
) -> TaskSignals:
    """What a task asks of a joint.

    Raises:
        InputError: if an own task gives something else, or what is not finite.
    """
    found = task(rng, time, reach)
    if not isinstance(found, TaskSignals):
        try:
            position = np.array(found, dtype=float)
        except (TypeError, ValueError):
            position = np.empty(0)
        if position.shape != time.shape:
            raise InputError(
                f"the task gives {type(found).__name__} of shape {np.shape(found)}; give positions"
                f" at the {len(time)} times, or TaskSignals"
            )
        # Of second order at the ends, too, or the acceleration there would be half of what it is.
        velocity = np.gradient(position, time, edge_order=2)
        acceleration = np.gradient(velocity, time, edge_order=2)
        found = _signals(time, position=position, velocity=velocity, acceleration=acceleration)
    for name, signal in vars(found).items():
        if np.shape(signal) != time.shape or not np.isfinite(signal).all():
            raise InputError(
                f"the task's {name} is no finite number at each of the {len(time)} times"
            )
    return found


def held(time: FloatArray, position: float) -> TaskSignals:
    """One position for all samples."""
    return _signals(time, position=np.full(len(time), position))


def _signals(time: FloatArray, **given: FloatArray) -> TaskSignals:
    zeros = dict.fromkeys(TaskSignals.__dataclass_fields__, np.zeros(len(time)))
    return TaskSignals(**{**zeros, **given})


def _steps(
    rng: np.random.Generator,
    time: FloatArray,
    *ranges: tuple[float, float],
    every: float = STEP_EVERY,
) -> FloatArray:
    """(ranges, n) of values that are drawn again from each range at equal intervals."""
    index = np.floor(time / every + 1e-9).astype(int)
    low, high = np.array(ranges).T
    return rng.uniform(low, high, (index[-1] + 1, len(ranges)))[index].T


def _ends(reach: Reach, share: float = 1.0) -> tuple[float, float]:
    return reach.centre - share * reach.travel, reach.centre + share * reach.travel


def regulation(rng: np.random.Generator, time: FloatArray, reach: Reach) -> TaskSignals:
    """One position for the whole episode."""
    return held(time, rng.uniform(*_ends(reach)))


def step(rng: np.random.Generator, time: FloatArray, reach: Reach) -> TaskSignals:
    """A new position every two seconds."""
    return _signals(time, position=_steps(rng, time, _ends(reach))[0])


def sine(rng: np.random.Generator, time: FloatArray, reach: Reach) -> TaskSignals:
    """A sine of half to full travel that grows from rest over a second."""
    height = reach.travel * rng.uniform(0.5, 1.0)
    low, high = np.log(SINE_HZ)
    turn = 2.0 * math.pi * math.exp(rng.uniform(low, high))
    return _tones(time, reach, np.array([height]), np.array([turn]), np.zeros(1))


def multisine(rng: np.random.Generator, time: FloatArray, reach: Reach) -> TaskSignals:
    """Five tones at random phases that grow from rest over a second; their peaks may add up."""
    turn = 2.0 * math.pi * np.array(MULTISINE_HZ)
    phase = rng.uniform(0.0, 2.0 * math.pi, len(turn))
    height = np.full(len(turn), reach.travel / len(turn) * 1.6)
    return _tones(time, reach, height, turn, phase)


def stiffness(rng: np.random.Generator, time: FloatArray, reach: Reach) -> TaskSignals:
    """A new position and a new stiffness of the joint every two seconds: rigs of fixed tendons."""
    position, wanted = _steps(rng, time, _ends(reach, 0.5), reach.stiffness)
    return _signals(time, position=position, stiffness=wanted)


def disturbance(rng: np.random.Generator, time: FloatArray, reach: Reach) -> TaskSignals:
    """One position, and a torque from outside that jumps every second, the first second apart."""
    position = np.full(len(time), rng.uniform(*_ends(reach, 0.5)))
    (torque,) = _steps(rng, time, (-reach.torque, reach.torque), every=1.0)
    return _signals(time, position=position, torque=np.where(time < 1.0 - 1e-9, 0.0, torque))


def _tones(
    time: FloatArray, reach: Reach, height: FloatArray, turn: FloatArray, phase: FloatArray
) -> TaskSignals:
    """Sines about the centre under an envelope that grows smoothly over the first second."""
    along = np.minimum(time, 1.0)
    envelope = along**3 * (10.0 - 15.0 * along + 6.0 * along**2)
    slope = np.where(time < 1.0, 30.0 * along**2 * (1.0 - along) ** 2, 0.0)
    bend = np.where(time < 1.0, 60.0 * along * (1.0 - along) * (1.0 - 2.0 * along), 0.0)
    at = turn * time[:, np.newaxis] + phase
    plain = (height * np.sin(at)).sum(axis=1)
    rate = (height * turn * np.cos(at)).sum(axis=1)
    acceleration = -(height * turn**2 * np.sin(at)).sum(axis=1)
    return _signals(
        time,
        position=reach.centre + envelope * plain,
        velocity=slope * plain + envelope * rate,
        acceleration=bend * plain + 2.0 * slope * rate + envelope * acceleration,
    )


TASKS: Mapping[str, Task] = MappingProxyType(
    {task.__name__: task for task in (regulation, step, sine, multisine, stiffness, disturbance)}
)
"""Name -> task."""
