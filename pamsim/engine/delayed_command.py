"""Commands that reach the valves late, each muscle's by its own dead time.

MuJoCo delays the control of its own actuator types only: a callback sees it as it was set. So the
delay is in the commands that a simulated experiment sets, and in no loop of ``mj_step`` of one's
own.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]


def delayed_commands(
    commands: FloatArray,
    before: Sequence[float],
    delays: Sequence[float],
    timestep: float,
    steps: int,
) -> FloatArray:
    """Mean over every time step of the command as it arrives.

    The mean keeps what an edge inside a step does to the air to first order, so that a simulation
    depends smoothly on a delay that is no whole number of steps.

    Args:
        commands: (n, m) held over each sample.
        before: (m,) held until time 0.
        delays: (m,) dead times [s].
        timestep: [s].
        steps: time steps per sample.

    Returns:
        (n, steps, m), in the unit of the commands.
    """
    table = np.repeat(commands, steps, axis=0)
    late = np.empty_like(table)
    for column, (delay, first) in enumerate(zip(delays, before, strict=True)):
        whole = math.floor(delay / timestep + 1e-9)
        rest = max(delay / timestep - whole, 0.0)
        told = np.concatenate([np.full(whole + 1, first), table[:, column]])
        arrived, earlier = told[1 : len(table) + 1], told[: len(table)]
        late[:, column] = arrived + rest * (earlier - arrived)
    return late.reshape(len(commands), steps, -1)


def stretches(rows: FloatArray) -> Iterator[tuple[FloatArray, int]]:
    """Yield each row with the number of times it repeats in a sequence, in order.

    Args:
        rows: (k, m).
    """
    edges = np.flatnonzero(np.any(rows[1:] != rows[:-1], axis=1)) + 1
    ends = [0, *edges.tolist(), len(rows)]
    for first, last in pairwise(ends):
        if last > first:
            yield rows[first], last - first
