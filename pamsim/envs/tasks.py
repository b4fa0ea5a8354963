"""What an arm may be asked to do: references for angle and stiffness, and torques that disturb it.

A task draws all that an episode asks for at its beginning, from one random generator.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from pamsim.envs.reach import Reach

FloatArray = NDArray[np.float64]

STEP_EVERY = 2.0
"""Time between two steps of a reference [s]."""

SINE_HZ = (0.2, 1.0)
"""Frequencies a sine is drawn from [Hz], evenly on a logarithmic scale."""

MULTISINE_HZ = (0.1, 0.3, 0.5, 0.7, 1.1)
"""Tones of the multisine [Hz]."""


@dataclass(frozen=True, kw_only=True)
class TaskSignals:
    """What an episode asks for, at each of its samples.

    Attributes:
        angle: (n,) [rad].
        rate: (n,) of that angle [rad/s]; 0 where it jumps.
        acceleration: (n,) [rad/s^2].
        stiffness: (n,) of the joint [N m/rad]; 0 where the task leaves it free.
        torque: (n,) on the joint from outside [N m].
    """

    angle: FloatArray
    rate: FloatArray
    acceleration: FloatArray
    stiffness: FloatArray
    torque: FloatArray


Task: TypeAlias = Callable[[np.random.Generator, FloatArray, Reach], TaskSignals]


def _signals(time: FloatArray, **given: FloatArray) -> TaskSignals:
    still = {
        name: np.zeros(len(time))
        for name in ("angle", "rate", "acceleration", "stiffness", "torque")
    }
    return TaskSignals(**{**still, **given})


def _steps(
    rng: np.random.Generator, time: FloatArray, low: float, high: float, every: float = STEP_EVERY
) -> FloatArray:
    index = np.floor(time / every + 1e-9).astype(int)
    return rng.uniform(low, high, index[-1] + 1)[index]


def regulation(rng: np.random.Generator, time: FloatArray, reach: Reach) -> TaskSignals:
    """One angle for the whole episode."""
    return _signals(time, angle=np.full(len(time), rng.uniform(-reach.angle, reach.angle)))


def step(rng: np.random.Generator, time: FloatArray, reach: Reach) -> TaskSignals:
    """A new angle every two seconds."""
    return _signals(time, angle=_steps(rng, time, -reach.angle, reach.angle))


def sine(rng: np.random.Generator, time: FloatArray, reach: Reach) -> TaskSignals:
    """A sine of half to full reach that grows from rest over a second."""
    height = reach.angle * rng.uniform(0.5, 1.0)
    low, high = np.log(SINE_HZ)
    turn = 2.0 * math.pi * math.exp(rng.uniform(low, high))
    return _tones(time, np.array([height]), np.array([turn]), np.zeros(1))


def multisine(rng: np.random.Generator, time: FloatArray, reach: Reach) -> TaskSignals:
    """Five tones at random phases that grow from rest over a second; their peaks may add up."""
    turn = 2.0 * math.pi * np.array(MULTISINE_HZ)
    phase = rng.uniform(0.0, 2.0 * math.pi, len(turn))
    height = np.full(len(turn), reach.angle / len(turn) * 1.6)
    return _tones(time, height, turn, phase)


def stiffness(rng: np.random.Generator, time: FloatArray, reach: Reach) -> TaskSignals:
    """A new angle and a new stiffness of the joint every two seconds."""
    angle = _steps(rng, time, -0.5 * reach.angle, 0.5 * reach.angle)
    return _signals(time, angle=angle, stiffness=_steps(rng, time, *reach.stiffness))


def disturbance(rng: np.random.Generator, time: FloatArray, reach: Reach) -> TaskSignals:
    """One angle, and a torque from outside that jumps every second, the first second apart."""
    torque = _steps(rng, time, -reach.torque, reach.torque, every=1.0)
    return _signals(
        time,
        angle=np.full(len(time), 0.5 * rng.uniform(-reach.angle, reach.angle)),
        torque=np.where(time < 1.0 - 1e-9, 0.0, torque),
    )


TASKS: Mapping[str, Task] = MappingProxyType(
    {
        "regulation": regulation,
        "step": step,
        "sine": sine,
        "multisine": multisine,
        "stiffness": stiffness,
        "disturbance": disturbance,
    }
)


def _tones(
    time: FloatArray, height: FloatArray, turn: FloatArray, phase: FloatArray
) -> TaskSignals:
    """A sum of sines [rad] under an envelope that grows smoothly over the first second."""
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
        angle=envelope * plain,
        rate=slope * plain + envelope * rate,
        acceleration=bend * plain + 2.0 * slope * rate + envelope * acceleration,
    )
