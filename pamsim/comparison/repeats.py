"""Repeats of one input: trials, with their mean as a trial, and periods of one command."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pamsim.comparison.link_inputs import sample_noise
from pamsim.core.units import FloatArray
from pamsim.recordings.trial import Trial, TrialLead

_SAME = 1e-6  # of a command's range, to which it is written
_SAME_TIME = 1e-6  # s: clocks that begin later, up to 1970, round to less; valves are slower
_SAME_NOISE = 6.0  # standard deviations from sample to sample, by which no two readings differ
_REGULATED = 0.05
"""Of the largest reading of its kind, by which an imposed signal may differ between repeats on
average: regulators come back to 1 % of their range, valves that are only timed to some per cent.
Levels that differ on purpose do by more.
"""
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
        lead = first.lead_in
        if lead is not None:
            leads = [trial.lead_in for trial in self.trials if trial.lead_in is not None]
            command = np.mean([one.command for one in leads], axis=0)
            start = np.mean([one.start_pressure for one in leads], axis=0)
            measured = {c: np.mean([o.measured[c] for o in leads], axis=0) for c in lead.measured}
            lead = replace(lead, command=command, start_pressure=start, measured=measured)
        return replace(
            first,
            lead_in=lead,
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
    commanded = np.flatnonzero(~np.array(first.drives.between))
    same = first.measured.keys() == other.measured.keys()
    return same and same_input(first, other, commanded) and _imposed_again(first, other)


def _imposed_again(first: Trial, other: Trial) -> bool:
    """What was read and is imposed differs by its noise, and by how exactly it was repeated."""
    kinds = np.array(first.drives.kinds)
    for column in np.flatnonzero(first.drives.between):
        own = np.stack([first.command[:, column], other.command[:, column]])
        of_kind = kinds == kinds[column]
        largest = max(float(np.abs(t.command[:, of_kind]).max()) for t in (first, other))
        limit = max(_SAME_NOISE * max(map(sample_noise, own)), _REGULATED * largest)
        if np.mean(np.abs(own[1] - own[0])) > limit:
            return False
    return True


def protocols_by_load(trials: Sequence[Trial]) -> dict[str, str]:
    """Name of each trial to its protocol, with the load where trials of the protocol differ in it.

    Trials of one protocol with different loads are no repeats.
    """
    loads: dict[str, set[float]] = {}
    for trial in trials:
        loads.setdefault(trial.protocol, set()).add(trial.load)
    return {
        trial.name: trial.protocol
        if len(loads[trial.protocol]) == 1
        else f"{trial.protocol}, {trial.load:g} kg"
        for trial in trials
    }


def same_input(first: Trial, other: Trial, columns: NDArray[np.intp] | None = None) -> bool:
    """Whether trials have one protocol, load, clock, and some columns of their commands.

    So they must before each, where they do not begin at rest.
    """
    own = slice(None) if columns is None else columns
    lead, its = first.lead_in, other.lead_in
    if lead is None or its is None:
        same_lead = lead is its
    else:
        same_lead = abs(lead.duration - its.duration) <= _SAME_TIME and _same_rows(lead, its, own)
    return (
        same_lead
        and first.protocol == other.protocol
        and first.drive == other.drive
        and first.load == other.load
        and _same_rows(first, other, own)
    )


def _same_rows(
    first: Trial | TrialLead, other: Trial | TrialLead, columns: slice | NDArray[np.intp]
) -> bool:
    return (
        first.time.shape == other.time.shape
        and float(np.abs(first.time - other.time).max(initial=0.0)) <= _SAME_TIME
        and np.array_equal(first.command[:, columns], other.command[:, columns])
    )


def samples_per_period(command: FloatArray) -> int | None:
    """Period of a command that goes on for two periods at least, in samples; None without one.

    Args:
        command: (n, m), held from each sample on: the last one is never acted on and may be any.
    """
    command = command[:-1]
    count = command.shape[0]
    # Of each column by itself: they may be Pa and rad.
    limit = _SAME * np.ptp(command, axis=0) if count else np.zeros(command.shape[1])
    if not limit.any():
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
