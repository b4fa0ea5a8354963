"""Repeats of one input: trials, with their mean as a trial, and periods of one command."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pamsim.core.units import FloatArray
from pamsim.recordings.trial import Trial

_SAME = 1e-6  # of a command's range, to which it is written
_PROBES = 32  # samples by which lags are sorted out before all samples are compared


@dataclass(frozen=True, kw_only=True)
class Repeats:
    """Trials of one protocol with the same commands, load and clock.

    Attributes:
        trials: one or more, in the order of their recording.
    """

    trials: tuple[Trial, ...]

    @property
    def name(self) -> str:
        """Name of the first of them."""
        return self.trials[0].name

    def mean(self) -> Trial:
        """The trial with the mean of all measured and imposed signals, under the first's name."""
        first = self.trials[0]
        return replace(
            first,
            command=np.mean([trial.command for trial in self.trials], axis=0),
            measured={
                channel: np.mean([trial.measured[channel] for trial in self.trials], axis=0)
                for channel in first.measured
            },
        )


def repeats(trials: Sequence[Trial]) -> tuple[Repeats, ...]:
    """Group trials that repeat each other, in the order of the first of each group."""
    groups: list[list[Trial]] = []
    for trial in trials:
        same = (group for group in groups if _repeat(group[0], trial))
        group = next(same, None)
        if group is None:
            groups.append([trial])
        else:
            group.append(trial)
    return tuple(Repeats(trials=tuple(group)) for group in groups)


def _repeat(first: Trial, other: Trial) -> bool:
    # What a sensor or a machine imposes differs by its noise.
    commanded = [kind != "measured" for kind in first.drives.muscles]
    same = first.measured.keys() == other.measured.keys()
    return same and same_input(first, other, np.flatnonzero(commanded))


def same_input(first: Trial, other: Trial, columns: NDArray[np.intp] | None = None) -> bool:
    """Whether trials have one protocol, load and clock, and some columns of their commands."""
    own = slice(None) if columns is None else columns
    return (
        first.protocol == other.protocol
        and first.drive == other.drive
        and first.load == other.load
        and np.array_equal(first.time, other.time)
        and np.array_equal(first.command[:, own], other.command[:, own])
        and first.lead_in is None
        and other.lead_in is None
    )


def samples_per_period(command: FloatArray) -> int | None:
    """Period of a command that goes on for two periods at least, in samples; None without one.

    Args:
        command: (n, m), held from each sample on: the last one is never acted on and may be any.
    """
    command = command[:-1]
    count = command.shape[0]
    limit = _SAME * float(np.ptp(command, axis=0).max()) if count else 0.0
    if limit == 0.0:
        return None
    most = (count + 1) // 2  # the last period may be one sample short
    lags = np.arange(2, most + 1)
    for at in range(0, count - most, max((count - most) // _PROBES, 1)):
        lags = lags[np.all(np.abs(command[at + lags] - command[at]) <= limit, axis=1)]
    for lag in lags.tolist():
        if np.all(np.abs(command[lag:] - command[:-lag]) <= limit):
            return lag
    return None


def periods(residual: FloatArray, command: FloatArray) -> FloatArray | None:
    """Periods of a command in a residual (n,), all but the first, (r, samples); None below two."""
    period = samples_per_period(command)
    whole = 0 if period is None else residual.size // period - 1
    if period is None or whole < 2:
        return None
    return residual[period : (whole + 1) * period].reshape(whole, period)
