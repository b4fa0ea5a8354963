"""Read recordings: a folder with ``recording.toml`` and one CSV per trial.

Columns per CSV: ``time_s``; what drives every muscle: ``flexor_valve`` (valve opening or pulse
duty, in [-1, 1]), ``flexor_set_kpa``, or the measured ``flexor_kpa``; then, as far as they were
measured, ``flexor_kpa``, ``flexor_n``, ``knee_deg`` of a joint that turns and ``slider_mm`` of one
that slides, and the torque ``knee_nm`` or force ``slider_n`` that acts on it from outside. For a
rig with one joint that turns also ``u1``, ``p1_set_kpa``, ``p1_kpa``, ``force1_n``, ``angle_deg``,
``torque_nm``: muscles by number. Pressures are gauge.

A log in a lab's own columns and units is read as it is if ``recording.toml`` says what they are,
see `pamsim.recordings.trial_columns`.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.limits import HEAVIEST_LOAD
from pamsim.core.toml_tables import NUMBER, check_keys, entry, read_toml
from pamsim.recordings import recording_checks, segments
from pamsim.recordings.recording import SCHEMA
from pamsim.recordings.signals import MUSCLE_DRIVES, Drive
from pamsim.recordings.table_reader import read_columns
from pamsim.recordings.trial import Trial, TrialSet
from pamsim.recordings.trial_columns import (
    TrialColumns,
    in_own_format,
    log_columns,
    trial_columns,
)

INDEX = "recording.toml"
WITH_COLUMNS = "pamsim-recording/2"
_TOP = ("schema", "rig", "columns", "trial")
_TRIAL = ("file", "protocol", "drive", "load_kg", *segments.KEYS)


def read_recordings(path: str | os.PathLike[str]) -> TrialSet:
    """Read the trials of a recording.

    A trial begins at rest at its first measured pressures or, where a pressure was not measured
    but commanded, at its first set points. Its clock is counted from its first row.

    Args:
        path: of the folder, or of its ``recording.toml``.

    Returns:
        The trials in SI, with notes on what was not measured, not used, or not uniform.

    Raises:
        InputError: in one line with file, line and column: a missing or unknown key, a missing
            command, a cell that is no finite number, fewer than 8 rows, a clock that stands, runs
            back or jumps, a command out of range, numbers that must be in another unit than their
            column says.
    """
    index = Path(path) / INDEX if Path(path).is_dir() else Path(path)
    table = _index(index)
    entries: list[Mapping[str, Any]] = table["trial"]
    log = log_columns(table["columns"], f"{index}: [columns]") if "columns" in table else None
    tables: list[TrialColumns] = []
    for one in entries:
        columns = read_columns(index.parent / one["file"])
        own = columns if log is None else in_own_format(columns, log)
        tables.append(trial_columns(own, one["drive"]))
        tables[-1].columns.require("time_s")
    notes: list[str] = []
    trials: list[Trial] = []
    for number, (one, own) in enumerate(zip(entries, tables, strict=True), start=1):
        where = f"{index}: trial {number}"
        trials += segments.trials_of(_trial(one, own, notes), one, where)
    if log is None:  # a log states its units itself, and bellows work at a few kPa
        recording_checks.units_of_all([t.columns for t in tables])
    for own in tables:
        if _muscles(own) != _muscles(tables[0]):
            raise InputError(
                f"{own.columns.path}: commands {_muscles(own)}, {tables[0].columns.path.name}"
                f" {_muscles(tables[0])}; a recording is of one rig"
            )
    return TrialSet(
        rig=_rig(index.parent, table["rig"]),
        trials=tuple(trials),
        notes=(*_not_measured(trials, tables), *notes),
    )


def _index(path: Path) -> Mapping[str, Any]:
    try:
        table = read_toml(path)
    except FileNotFoundError:
        raise InputError(
            f"no recording at {path.parent if path.name == INDEX else path}: give a folder with"
            f" {INDEX}, or that file"
        ) from None
    if table.get("schema") not in (SCHEMA, WITH_COLUMNS):
        raise InputError(
            f"{path}: schema is {table.get('schema')!r}; this pamsim reads {SCHEMA!r} and, with"
            f" [columns], {WITH_COLUMNS!r}"
        )
    check_keys(table, _TOP, path)
    entry(table, "rig", str, f'{path}: needs rig = "...": the name or path of the rig it is of')
    needs = f"{path}: no trial; write [[trial]] with file, protocol, drive, load_kg"
    entries: list[Any] = entry(table, "trial", list, needs)
    if not entries or not all(isinstance(one, Mapping) for one in entries):
        raise InputError(needs)
    for number, one in enumerate(entries, start=1):
        _check_entry(f"{path}: trial {number}", one)
    files = [one["file"] for one in entries]
    for file in files:
        if files.count(file) > 1:
            raise InputError(f"{path}: file {file!r} is two trials; name each file once")
    return table


def _check_entry(where: str, table: Mapping[str, Any]) -> None:
    check_keys(table, _TRIAL, where)
    for key in ("file", "protocol"):
        entry(table, key, str, f'{where} needs {key} = "..."')
    needs = (
        f'{where} needs drive = "...", of {", ".join(MUSCLE_DRIVES)}, or a table with one for'
        " each muscle and driven joint"
    )
    drive = entry(table, "drive", str | Mapping, needs)
    if not drive:
        raise InputError(needs)
    try:
        Drive.of(drive, len(drive))
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    needs = f"{where} needs load_kg = ..., the mass on the arm, 0 for none: {{!r}}"
    load = entry(table, "load_kg", NUMBER, needs, 0.0)
    if not load >= 0.0:
        raise InputError(needs.replace("{!r}", repr(load)))
    if load > HEAVIEST_LOAD:
        raise InputError(f"{where}: load_kg = {load:g} is no load for an arm; write kg, not g")


def _trial(table: Mapping[str, Any], found: TrialColumns, notes: list[str]) -> Trial:
    name = Path(table["file"]).with_suffix("").as_posix()
    columns = found.columns
    jitter = recording_checks.clock(columns)
    recording_checks.units(columns, list(zip(found.command, found.drives.kinds, strict=True)))
    notes += [f"{name}: {jitter}"] if jitter else []
    used = {"time_s", *found.command, *found.channels}
    unused = [*columns.ignored, *(column for column in columns.cells if column not in used)]
    notes += [f"{name}: column {column!r} is not used" for column in unused]
    time = columns.values["time_s"]
    return Trial(
        name=name,
        protocol=table["protocol"],
        drive=table["drive"],
        load=float(table.get("load_kg", 0.0)),
        time=time - time[0],
        command=np.column_stack(
            [columns.si(column) if column else np.zeros(time.size) for column in found.command]
        ),
        measured={
            channel: columns.si(column)
            for column, channel in found.channels.items()
            if column in columns.cells
        },
        muscle_names=found.muscles,
    )


def _muscles(table: TrialColumns) -> str:
    return ", ".join(sorted(table.muscles)) or f"{len(table.drives.muscles)} muscles"


def _rig(folder: Path, rig: str) -> str:
    """The rig as `pamsim.load_rig` finds it from anywhere: a path is relative to the recording."""
    beside = folder / rig
    return str(beside) if os.path.isfile(beside / "params.toml") else rig


def _not_measured(trials: Sequence[Trial], tables: Sequence[TrialColumns]) -> list[str]:
    every = dict.fromkeys(channel for table in tables for channel in table.channels.values())
    notes: list[str] = []
    for channel in every:
        missing = [trial.name for trial in trials if channel not in trial.measured]
        if missing:
            where = "any trial" if len(missing) == len(trials) else ", ".join(missing)
            notes.append(f"{channel} was not measured in {where}")
    return notes
