"""Logs of one input that were started and stopped by hand, cut to the rows that all have.

A logger runs for some samples before the first command, and on until somebody stops it. Trials of
one protocol are repeats of each other from their first command on: what comes before it is rest.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pamsim.comparison.repeats import same_settings, what_differs
from pamsim.core.errors import first_few
from pamsim.recordings.start_pressures import SHUT_AT_0
from pamsim.recordings.trial import Trial

_MOST_CUT = 0.25  # of the longest log: one that stops much earlier is better recorded again
_SHOWN = 4  # names in a sentence


def aligned(trials: Sequence[Trial]) -> tuple[tuple[Trial, ...], tuple[str, ...]]:
    """Trials, of which those that repeat each other but for where they begin and end are cut.

    Returns:
        The trials, in their order, and sentences: what was cut, and which trials of one protocol
        are no repeats, and why.
    """
    found = {trial.name: trial for trial in trials}
    inputs: list[Trial] = []  # the first trial of each
    cut, apart = dict[str, int](), dict[str, tuple[str, str]]()
    left = list(trials)
    while left:
        first = left[0]
        late = {trial.name: _rows_late(first, trial) for trial in left}
        group = [trial for trial in left if late[trial.name] is not None]
        own = _cut(group, [late[trial.name] or 0 for trial in group])
        found.update((trial.name, trial) for trial in own)
        if any(new is not old for new, old in zip(own, group, strict=True)):
            cut[first.protocol] = own[0].time.size
        known = next((one for one in inputs if same_settings(one, first)), None)
        if known is not None and first.protocol not in apart:
            why = what_differs(*_cut([known, first], [0, _late_by_command(known, first)]))
            apart[first.protocol] = why, f"{known.name} and {first.name}"
        inputs.append(first)
        left = [trial for trial in left if late[trial.name] is None]
    notes = [
        f"no repeats though of one protocol: {first_few(pairs, _SHOWN)}: {why}"
        for why in dict.fromkeys(why for why, _ in apart.values())
        for pairs in [[pair for own, pair in apart.values() if own == why]]
    ]
    if cut:
        named = [f"{protocol} ({count} rows)" for protocol, count in cut.items()]
        rows = first_few(named, _SHOWN)
        notes.insert(0, f"repeats begin or end at other rows, and are cut to those of all: {rows}")
    return tuple(found.values()), tuple(notes)


def _rows_late(first: Trial, other: Trial) -> int | None:
    """By how many rows another trial of one input comes later; None if it is of another input."""
    if not same_settings(first, other):
        return None
    for late in dict.fromkeys((0, _late_by_command(first, other))):
        if not what_differs(*_cut([first, other], [0, late])):
            return late
    return None


def _late_by_command(first: Trial, other: Trial) -> int:
    commands = [_first_command(trial) for trial in (first, other)]
    return commands[1] - commands[0] if all(commands) else 0


def _cut(trials: Sequence[Trial], late: Sequence[int]) -> list[Trial]:
    """Trials from the first row that all have on, given by how many rows each comes later."""
    begins = [rows - min(late) for rows in late]
    count = min(trial.time.size - row for trial, row in zip(trials, begins, strict=True))
    if count < (1.0 - _MOST_CUT) * max(trial.time.size for trial in trials):
        return list(trials)
    return [
        trial if count == trial.time.size else trial.rows(slice(row, row + count))
        for trial, row in zip(trials, begins, strict=True)
    ]


def _first_command(trial: Trial) -> int:
    """Row at which the first command of a trial that begins at rest changes; 0 for none."""
    held = ~np.array(trial.drives.between)
    for kind, command in zip(trial.drives.kinds, trial.command[0], strict=True):
        if trial.lead_in is not None or (kind in SHUT_AT_0 and command != 0.0):
            return 0
    changed = np.any(np.diff(trial.command[:, held], axis=0) != 0.0, axis=1)
    return 1 + int(np.argmax(changed)) if changed.any() else 0
