"""Repeats of one input, and their mean as a trial."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pamsim.recordings.trial import Trial


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
    columns = np.flatnonzero(np.array(commanded, dtype=bool))
    return (
        first.protocol == other.protocol
        and first.drive == other.drive
        and first.load == other.load
        and first.measured.keys() == other.measured.keys()
        and np.array_equal(first.time, other.time)
        and np.array_equal(first.command[:, columns], other.command[:, columns])
        and first.lead_in is None
        and other.lead_in is None
    )
