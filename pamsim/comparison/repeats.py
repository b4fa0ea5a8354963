"""Repeats of one input: trials, with their mean as a trial, and periods of one command."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from pamsim.comparison.link_inputs import sample_noise
from pamsim.core.units import FloatArray
from pamsim.recordings.trial import Trial, TrialLead

_SAME = 1e-6  # of a command's range, to which it is written
_SAME_TIME = 1e-6  # s: clocks that begin later, up to 1970, round to less; valves are slower
_LATE = 3
"""Samples by which a command may change earlier or later than in a repeat: a loop that reads, logs
and commands by turns writes it into the next row or the one after, and so does what it is compared
with. What that changes is simulated for each trial.
"""
_ABOUT = 2 * _LATE + 1
_SAME_NOISE = 6.0  # standard deviations from sample to sample, by which no two readings differ
_REGULATED = 0.05
"""Of the largest reading of its kind, by which an imposed signal may differ between repeats on
average: regulators come back to 1 % of their range, valves that are only timed to some per cent.
Levels that differ on purpose do by more.
"""
_BEFORE = 'what comes before them differs; if each begins at rest, state lead_in = "0 s"'
_PROBES = 32  # samples by which lags are sorted out before all samples are compared


@dataclass(frozen=True, kw_only=True)
class Repeats:
    """Trials of one protocol with the same commands, load and clock."""

    trials: tuple[Trial, ...]  # one or more, in the order of their recording

    @property
    def name(self) -> str:
        """Name of the first of them."""
        return self.trials[0].name

    def mean(self) -> Trial:
        """The trial with the mean of all measured and imposed signals, under the first's name."""
        lead = self.trials[0].lead_in
        if lead is not None:
            leads = [trial.lead_in for trial in self.trials if trial.lead_in is not None]
            start = np.mean([one.start_pressure for one in leads], axis=0)
            lead = replace(lead, start_pressure=start, **_means(leads))
        return replace(self.trials[0], lead_in=lead, **_means(self.trials))


def _means(parts: Sequence[Trial] | Sequence[TrialLead]) -> dict[str, Any]:
    return {
        "command": np.mean([part.command for part in parts], axis=0),
        "measured": {
            channel: np.mean([part.measured[channel] for part in parts], axis=0)
            for channel in parts[0].measured
        },
    }


def repeats(trials: Sequence[Trial]) -> tuple[Repeats, ...]:
    """Group trials that repeat each other, in the order of the first of each group."""
    groups: list[list[Trial]] = []
    for trial in trials:
        for group in groups:
            if same_settings(group[0], trial) and not what_differs(group[0], trial):
                group.append(trial)
                break
        else:
            groups.append([trial])
    return tuple(Repeats(trials=tuple(group)) for group in groups)


def what_differs(first: Trial, other: Trial) -> str:
    """In what trials of one protocol, drive and load do not repeat each other; empty if they do.

    Commands may change a few rows earlier or later.
    """
    if first.measured.keys() != other.measured.keys():
        return "not the same signals were measured"
    lead = first.lead_in
    if not _same_lead_clock(lead, other.lead_in):
        return _BEFORE
    if first.time.shape != other.time.shape:
        return f"they have {first.time.size} and {other.time.size} rows"
    if not _same_clock(first, other):
        return "their clocks differ; state the same `rate` in every [[trial]]"
    before = 0 if lead is None else lead.time.size
    own, its = (
        t.command if t.lead_in is None else np.concatenate([t.lead_in.command, t.command])
        for t in (first, other)
    )
    for column in np.flatnonzero(~np.array(first.drives.between)):
        at = _other_from(own[:, column], its[:, column])
        if at is not None and at < before:
            return _BEFORE
        if at is not None:
            return f"their commands differ from {first.time[at - before]:.4g} s on"
    return "" if _imposed_again(first, other) else "what is imposed on them differs"


def _other_from(own: FloatArray, its: FloatArray) -> int | None:
    """First row in which a held command (n,) is none that another has a few rows off; else None.

    What precedes the first rows and follows the last, in which one may still change, is not known.
    """
    ends = min(_LATE, (len(own) - 1) // 2)
    rows = slice(ends, len(own) - ends)
    apart = np.zeros(len(own), dtype=bool)
    for one, two in ((own, its), (its, own)):
        low, high = minimum_filter1d(two, _ABOUT), maximum_filter1d(two, _ABOUT)
        written_over = (high - low) / (2 * _LATE)  # the row at the peak of a sine may be missing
        apart |= (one < low - written_over) | (one > high + written_over)
    return ends + int(np.argmax(apart[rows])) if apart[rows].any() else None


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


def same_input(first: Trial, other: Trial) -> bool:
    """Whether trials have one protocol, load, clock, and the same command in every row.

    So they must before each, where they do not begin at rest.
    """
    lead, its = first.lead_in, other.lead_in
    return (
        same_settings(first, other)
        and _same_lead_clock(lead, its)
        and (lead is None or its is None or np.array_equal(lead.command, its.command))
        and _same_clock(first, other)
        and np.array_equal(first.command, other.command)
    )


def same_settings(first: Trial, other: Trial) -> bool:
    """Whether trials are of one protocol, drive and load, as repeats are."""
    return (
        first.protocol == other.protocol and first.drive == other.drive and first.load == other.load
    )


def _same_lead_clock(lead: TrialLead | None, its: TrialLead | None) -> bool:
    if lead is None or its is None:
        return lead is its
    return abs(lead.duration - its.duration) <= _SAME_TIME and _same_clock(lead, its)


def _same_clock(first: Trial | TrialLead, other: Trial | TrialLead) -> bool:
    return (
        first.time.shape == other.time.shape
        and float(np.abs(first.time - other.time).max(initial=0.0)) <= _SAME_TIME
    )


def samples_per_period(command: FloatArray) -> int | None:
    """Period of a command that goes on for two periods at least, in samples; None without one.

    The command (n, m) is held from each sample on: the last one is never acted on and may be any.
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
