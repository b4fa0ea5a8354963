"""Data to identify from: recordings, or tables of any columns."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

from pamsim.core.errors import InputError, nearest
from pamsim.identification.plain_table import plain_trials
from pamsim.identification.signals import SignalTable, table_of
from pamsim.recordings.columns import Columns
from pamsim.recordings.recording_reader import read_recordings
from pamsim.recordings.table_reader import read_columns
from pamsim.recordings.trial import TrialSet


@dataclass(frozen=True, kw_only=True)
class IdentifyData:
    """Trials to identify from."""

    source: str  # path, or the simulation in words
    # name or path of the rig; empty if unknown, or if some of the data are tables, whose trials
    # need not begin at rest
    rig: str
    tables: tuple[SignalTable, ...]  # one per trial
    notes: tuple[str, ...]  # what a reader should know


Source: TypeAlias = str | os.PathLike[str]


Read: TypeAlias = tuple[str, TrialSet | Columns]
"""Where data come from, and what was read there."""


def read_data(data: Source | TrialSet | Sequence[Source]) -> list[Read]:
    """Read recordings and tables; arguments as those of `identify`."""
    if isinstance(data, TrialSet):
        return [(f"{', '.join(trial.name for trial in data.trials)} of {data.rig}", data)]
    paths = map(Path, [data] if isinstance(data, str | os.PathLike) else data)
    return [(str(path), _read(path)) for path in paths]


def _read(path: Path) -> TrialSet | Columns:
    if path.suffix.lower() == ".toml" or not (path.suffix or path.is_file()) or path.is_dir():
        return read_recordings(path)
    return read_columns(path, numbers_only=True)


def trials_of(
    read: Sequence[Read],
    *,
    time: str | None = None,
    dt: float | None = None,
    hold: str | None = None,
) -> IdentifyData:
    """Return the trials of recordings and tables; arguments as those of `identify`."""
    if not read:
        raise InputError("no data given; give a recording or a table")
    parts: list[tuple[SignalTable, ...]] = []
    notes: list[str] = []
    for source, one in read:
        if isinstance(one, Columns):
            tables, remarks = plain_trials(one, time=time, dt=dt, hold=hold)
        else:
            for name, value in (("time", time), ("dt", dt), ("hold", hold)):
                if value is not None:
                    raise InputError(
                        f"`{name}` is for tables; the recording {source} states it itself, omit it"
                    )
            tables, remarks = tuple(map(table_of, one.trials)), one.notes
        parts.append(tables)
        notes += remarks
    times = Counter(table.name for part in parts for table in part)
    tables = [
        _in_folder(table, *one) if times[table.name] > 1 else table
        for one, part in zip(read, parts, strict=True)
        for table in part
    ]
    for name, count in Counter(table.name for table in tables).items():
        if count > 1:
            raise InputError(f"trial {name!r} is there twice; rename one of the files")
    rigs = [one.rig if isinstance(one, TrialSet) else "" for _, one in read]
    return IdentifyData(
        source=", ".join(source for source, _ in read),
        rig=rigs[0] if all(rigs) else "",
        tables=tuple(tables),
        notes=tuple(dict.fromkeys(notes)),
    )


def _in_folder(table: SignalTable, source: str, read: TrialSet | Columns) -> SignalTable:
    """The table by its folder's name, too: files of one name lie in folders that differ."""
    name = f"{Path(source).parent.name}/{table.name}"
    # Recordings state what repeats what; of plain tables none is known to repeat another.
    return replace(table, name=name, protocol=name if isinstance(read, Columns) else table.protocol)


def select_trials(
    data: IdentifyData,
    trials: str | Sequence[str],
    protocols: str | Sequence[str],
    hold_out: str | Sequence[str] | float,
) -> tuple[list[SignalTable], list[SignalTable]]:
    """Trials to fit and trials to hold out; names and the share as in `identify`."""
    if isinstance(hold_out, int | float):
        return split_tables(select_trials(data, trials, protocols, ())[0], hold_out)
    trials, protocols, hold_out = (
        [given] if isinstance(given, str) else given for given in (trials, protocols, hold_out)
    )
    names = [table.name for table in data.tables]
    kinds = {table.protocol for table in data.tables}
    for argument, wanted, known in (
        ("trials", trials, names),
        ("protocols", protocols, kinds),
        ("hold_out", hold_out, names),
    ):
        for name in wanted:
            if name not in known:
                raise InputError(
                    f"`{argument}`: {name!r} is not in the data; {nearest(name, known)}"
                )
    used = [
        table
        for table in data.tables
        if (not trials or table.name in trials)
        and (not protocols or table.protocol in protocols)
        and table.name not in hold_out
    ]
    if not used:
        raise InputError("no trial is left to fit; change `trials`, `protocols` or `hold_out`")
    return used, [table for table in data.tables if table.name in hold_out]


def split_tables(
    tables: Sequence[SignalTable], share: float
) -> tuple[list[SignalTable], list[SignalTable]]:
    """Hold out the last part, a share of the rows, of every trial: every row is in one of both.

    That part is a trial of its own, ``NAME_end``, which begins in whatever state the trial was in.
    """
    if not 0.0 < share < 1.0:
        raise InputError(f"`hold_out` = {share:g} is no share of a trial; give one such as 0.3")
    to_fit: list[SignalTable] = []
    to_test: list[SignalTable] = []
    for table in tables:
        kept = table.time.size - round(share * table.time.size)
        if not 0 < kept < table.time.size:
            raise InputError(
                f"`hold_out` = {share:g} leaves no row of trial {table.name!r} to"
                f" {'fit' if kept < 1 else 'hold out'}; give another share"
            )
        to_fit.append(table.rows(table.name, slice(0, kept)))
        to_test.append(table.rows(f"{table.name}_end", slice(kept, None)))
    return to_fit, to_test
