"""Data to identify from: recordings, or tables of any columns."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping, Sequence
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


def only_table(data: Source | TrialSet | Sequence[Source]) -> Columns | None:
    """The table that all data are in, as read; None for recordings and several files."""
    if isinstance(data, TrialSet):
        return None
    paths = [data] if isinstance(data, str | os.PathLike) else list(data)
    if len(paths) != 1 or _is_recording(Path(paths[0])):
        return None
    return read_columns(Path(paths[0]), numbers_only=True)


def _is_recording(path: Path) -> bool:
    return path.suffix.lower() == ".toml" or not (path.suffix or path.is_file()) or path.is_dir()


def load_data(
    data: Source | TrialSet | Columns | Sequence[Source],
    *,
    time: str | None = None,
    dt: float | None = None,
    hold: str | None = None,
) -> IdentifyData:
    """Read what is to be identified; arguments as those of `identify`, or a table as read."""
    stated = {"time": time, "dt": dt, "hold": hold}
    if isinstance(data, TrialSet):
        _refuse_for_recording(data.rig, stated)
        source = f"{', '.join(trial.name for trial in data.trials)} of {data.rig}"
        return _recorded(data, source)
    given = [data] if isinstance(data, str | os.PathLike | Columns) else list(data)
    paths = [one.path if isinstance(one, Columns) else Path(one) for one in given]
    if not paths:
        raise InputError("no data given; give a recording or a table")
    parts: list[IdentifyData] = []
    for path, one in zip(paths, given, strict=True):
        if _is_recording(path):
            _refuse_for_recording(path, stated)
            parts.append(_recorded(read_recordings(path), str(path)))
        else:
            table = one if isinstance(one, Columns) else read_columns(path, numbers_only=True)
            tables, notes = plain_trials(table, time=time, dt=dt, hold=hold)
            parts.append(IdentifyData(source=str(path), rig="", tables=tables, notes=notes))
    times = Counter(table.name for part in parts for table in part.tables)
    tables = [
        _in_folder(table, path) if times[table.name] > 1 else table
        for path, part in zip(paths, parts, strict=True)
        for table in part.tables
    ]
    for name, count in Counter(table.name for table in tables).items():
        if count > 1:
            raise InputError(f"trial {name!r} is there twice; rename one of the files")
    return IdentifyData(
        source=", ".join(part.source for part in parts),
        rig=parts[0].rig if all(part.rig for part in parts) else "",
        tables=tuple(tables),
        notes=tuple(dict.fromkeys(note for part in parts for note in part.notes)),
    )


def _in_folder(table: SignalTable, path: Path) -> SignalTable:
    """The table by its folder's name, too: files of one name lie in folders that differ."""
    name = f"{path.parent.name}/{table.name}"
    # Recordings state what repeats what; of plain tables none is known to repeat another.
    return replace(table, name=name, protocol=table.protocol if _is_recording(path) else name)


def _refuse_for_recording(recording: object, stated: Mapping[str, object]) -> None:
    for name, value in stated.items():
        if value is not None:
            raise InputError(
                f"`{name}` is for tables; the recording {recording} states it itself, omit it"
            )


def _recorded(trials: TrialSet, source: str) -> IdentifyData:
    tables = tuple(table_of(trial) for trial in trials.trials)
    return IdentifyData(source=source, rig=trials.rig, tables=tables, notes=trials.notes)


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
