"""Noise of one trial from itself, where no other repeats its input.

A residual holds noise and what the model misses. In order of preference they are separated by

* periods: where the command goes through three periods or more, all but the first are repeats;
* holds: while a command is held and has settled, what the model misses hardly changes over `LAG`;
  noise that drifts more slowly goes unseen;
* the trial: what the model misses is smooth from one sample to the next, but for the moments that a
  median ignores; noise that drifts at all goes unseen.
"""

from __future__ import annotations

from enum import StrEnum
from itertools import pairwise

import numpy as np

from pamsim.comparison.periodicity import samples_per_period
from pamsim.core.units import FloatArray
from pamsim.inference.noise_model import Scatter
from pamsim.recordings.step_metrics import rough_noise

LAG = 0.5
"""Time over which residuals are compared [s]."""

SETTLED = 0.5
"""Time after a change of the command at which a hold begins to count [s]."""

_ENOUGH = 0.25  # share of the trial's samples that its holds must give


class FloorRoute(StrEnum):
    """How a noise floor is known."""

    REPEATS = "repeats"
    PERIODS = "periods"
    HOLDS = "holds"
    WITHIN_TRIALS = "within trials"
    STATED = "stated"


def noise_within_trial(
    residual: FloatArray, interval: float, command: FloatArray | None
) -> tuple[FloorRoute, Scatter]:
    """Noise of one channel of one trial.

    Args:
        residual: (n,) of any parameters [SI].
        interval: between samples [s].
        command: (n, m); None if it is not known.

    Returns:
        The route, and the noise's squares.
    """
    if command is not None:
        period = samples_per_period(command)
        whole = 0 if period is None else residual.size // period - 1
        if period is not None and whole > 1:
            runs = residual[period : (whole + 1) * period].reshape(whole, period)
            square = float(np.sum((runs - runs.mean(axis=0)) ** 2))
            return FloorRoute.PERIODS, Scatter(square, (whole - 1) * period)
        lag = _lag(residual, interval)
        held = [residual[rows] for rows in settled_holds(command, interval)]
        held = [r for r in held if r.size > 2 * lag]
        count = sum(map(len, held))
        if count - 2 * lag * len(held) >= _ENOUGH * residual.size:
            return FloorRoute.HOLDS, Scatter(rough_noise(*held, lag=lag) ** 2 * count, count)
    count = residual.size
    return FloorRoute.WITHIN_TRIALS, Scatter(rough_noise(residual) ** 2 * count, count)


def _lag(residual: FloatArray, interval: float) -> int:
    """`LAG` in samples; less in a trial shorter than four of it."""
    return min(max(round(LAG / interval), 1), max((residual.size - 1) // 4, 1))


def settled_holds(command: FloatArray, interval: float) -> list[slice]:
    """Samples at which a command is held and has been for `SETTLED`.

    Args:
        command: (n, m).
        interval: between samples [s].
    """
    changed = np.flatnonzero(np.any(np.diff(command, axis=0) != 0.0, axis=1)) + 1
    ends = [0, *changed.tolist(), command.shape[0]]
    wait = round(SETTLED / interval)
    return [slice(start + wait, stop) for start, stop in pairwise(ends) if stop - start > wait]
