"""Excitations that make effects visible: scalar signals over time, between -1 and 1.

Each is a pure function of time (n,) [s]; what it drives, and how far, is the caller's.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pamsim.core.units import FloatArray


def triangle(time: FloatArray, period: float, shrink: float = 1.0) -> FloatArray:
    """Triangle wave (n,) of a period [s], from 0, upwards first; loops at constant rate.

    The amplitude shrinks by a factor from one period to the next; below 1 draws minor loops.
    """
    phase = time / period
    shape = 1.0 - 4.0 * np.abs(np.mod(phase + 0.25, 1.0) - 0.5)
    return shape * shrink ** np.floor(phase + 1e-9)


def held_levels(time: FloatArray, hold: float, count: int, rng: np.random.Generator) -> FloatArray:
    """Random levels, each held; long holds show creep and leaks, jumps show flows and delays.

    ``count`` levels are drawn evenly (a shuffled ladder), so that every record covers the range.
    """
    ladder = np.linspace(-1.0, 1.0, count)
    number = _number(time, hold)
    rounds = int(number.max()) // count + 1
    return np.concatenate([rng.permutation(ladder) for _ in range(rounds)])[number]


def multisine(time: FloatArray, period: float, lines: int, rng: np.random.Generator) -> FloatArray:
    """Odd multisine of random phases with unexcited detection lines; its peak over a period is 1.

    Of each group of four odd harmonics the third is left out: there, and at the even ones, whatever
    the output shows is distortion, not linear response (Pintelon and Schoukens, System
    Identification, 2012, section 4.3).

    Over a period [s] of the fundamental there are so many odd harmonics, ``lines``, those left out
    included; their phases are random.
    """
    number = np.arange(lines)
    excited = (2 * number + 1)[number % 4 != 2]
    phases = rng.uniform(0.0, 2.0 * np.pi, excited.size)

    def at(when: FloatArray) -> FloatArray:
        angle = 2.0 * np.pi * np.outer(when / period, excited) + phases
        # Amplitudes fall with frequency: the arm is a low pass, and sharp motion is for bursts.
        return np.cos(angle) @ (1.0 / np.sqrt(excited))

    peak = np.abs(at(np.linspace(0.0, period, 64 * int(excited[-1]) + 1))).max()
    return at(time) / peak


def bursts(
    time: FloatArray, spacing: float, shortest: float, longest: float, rng: np.random.Generator
) -> FloatArray:
    """Short full openings of either sign with shut holds between, each followed by its opposite.

    They follow each other at a ``spacing`` [s], longer than the ``longest`` [s].
    """
    number = _number(time, spacing)
    pairs = int(number.max()) // 2 + 1
    length = np.repeat(rng.uniform(shortest, longest, pairs), 2)
    sign = np.repeat(rng.choice([-1.0, 1.0], pairs), 2)
    sign[1::2] *= -1.0
    inside = time - number * spacing < length[number] - 1e-9
    return np.where(inside, sign[number], 0.0)


def _number(time: FloatArray, width: float) -> NDArray[np.int64]:
    """Number of the interval of a width that each time lies in."""
    return np.floor(time / width + 1e-9).astype(np.int64)
