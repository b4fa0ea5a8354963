"""Commands that reach the valves late, each muscle's by its own dead time.

MuJoCo delays the control of its own actuator types only: a plugin sees it as it was set. So the
delay is in the commands that a simulated experiment sets, and in no loop of ``mj_step`` of one's
own. A command that arrives within a time step divides it in two, so that what follows depends
smoothly on the delay.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]
Stretch: TypeAlias = tuple[FloatArray, float, int]
"""Command (m,), length of a time step [s], number of such steps."""

_ROUNDING = 1e-6  # of a time step: a change closer to its end counts as at the end


def arriving_commands(
    commands: FloatArray,
    before: Sequence[float],
    delays: Sequence[float],
    timestep: float,
    steps: int,
) -> list[list[Stretch]]:
    """Commands that reach the valves in each sample, in stretches of equal time steps.

    Args:
        commands: (n, m) held over each sample.
        before: (m,) held until time 0.
        delays: (m,) dead times [s].
        timestep: [s].
        steps: time steps per sample.

    Returns:
        (n,) stretches of each sample, in order; their lengths add up to the sample's.
    """
    edges: list[list[tuple[float, int, float]]] = [[] for _ in commands]
    for muscle, (delay, first) in enumerate(zip(delays, before, strict=True)):
        values = np.concatenate([[first], commands[:, muscle]])
        for sample in np.flatnonzero(np.diff(values)).tolist():
            late = delay / timestep
            if abs(late - round(late)) < _ROUNDING:
                late = float(round(late))
            at, offset = divmod(sample * steps + late, steps)
            if at < len(commands):
                edges[int(at)].append((offset, muscle, float(values[sample + 1])))
    row, plan = np.array(before, dtype=float), []
    for arriving in edges:
        plan.append(_stretches(row, sorted(arriving), timestep, steps))
        for _, muscle, value in sorted(arriving):
            row = row.copy()
            row[muscle] = value
    return plan


def _stretches(
    row: FloatArray, arriving: list[tuple[float, int, float]], timestep: float, steps: int
) -> list[Stretch]:
    stretches: list[Stretch] = []
    points = sorted({*map(float, range(steps + 1)), *(offset for offset, _, _ in arriving)})
    for begin, end in pairwise(points):
        now = row.copy()
        for offset, muscle, value in arriving:
            if offset <= begin:
                now[muscle] = value
        # A whole step is the time step itself, without the rounding of a difference.
        whole = begin == math.floor(begin) and end == begin + 1.0
        length = timestep if whole else (end - begin) * timestep
        if stretches and stretches[-1][1] == length and np.array_equal(stretches[-1][0], now):
            stretches[-1] = (now, length, stretches[-1][2] + 1)
        else:
            stretches.append((now, length, 1))
    return stretches
