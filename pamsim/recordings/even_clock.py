"""A log on an even clock, ``rate = "50 Hz"`` of a trial in ``recording.toml``.

A log whose clock is not even is simulated at 2000 Hz so that no command is late. On an even clock
that divides 2000 Hz, a simulation takes as few samples as the log has.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.core.units import parse_quantity
from pamsim.recordings.trial import Trial

KEY = "rate"
"""Of a trial's entry in ``recording.toml``."""

_ROUNDING = 1e-9  # of a time that is a whole number of samples [s]


def on_even_clock(trial: Trial, rate: object, where: str) -> Trial:
    """A trial sampled evenly from its first row on.

    What was measured is taken on the line between two rows, a command that is held from the nearest
    row: which of two rows a step lies nearer to is all that the log shows.

    Args:
        trial: as logged.
        rate: as written, such as ``"50 Hz"``.
        where: file and trial, for errors.

    Raises:
        InputError: for a rate without meaning, or above the log's own.
    """
    if not isinstance(rate, str):
        raise InputError(f'{where}: rate = {rate!r}; write a rate such as "50 Hz"')
    hertz = parse_quantity(rate, "Hz", "Hz", where=f"{where}: rate")
    own = (trial.time.size - 1) / float(trial.time[-1])
    if not (math.isfinite(hertz) and 0.0 < hertz <= 1.001 * own):
        raise InputError(
            f"{where}: rate = {rate!r}; the log has {own:.4g} rows per second, write fewer"
        )
    time = np.arange(math.floor(trial.time[-1] * hertz + _ROUNDING) + 1) / hertz

    def between(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.interp(time, trial.time, values)

    nearest = np.round(between(np.arange(trial.time.size, dtype=float))).astype(int)
    command = trial.command[nearest]
    for column, straight in enumerate(trial.drives.between):
        if straight:
            command[:, column] = between(trial.command[:, column])
    measured = {channel: between(values) for channel, values in trial.measured.items()}
    return replace(trial, time=time, command=command, measured=measured)
