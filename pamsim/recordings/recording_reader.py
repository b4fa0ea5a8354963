"""Read recordings: a folder with ``recording.toml`` and one CSV per trial.

Columns per CSV: ``time_s``; what drives every muscle: ``flexor_valve`` (valve opening or pulse
duty, in [-1, 1]), ``flexor_set_kpa``, or the measured ``flexor_kpa``; then, as far as they were
measured, ``flexor_kpa``, ``flexor_n``, ``knee_deg`` of a joint that turns and ``slider_mm`` of one
that slides, and the torque ``knee_nm`` or force ``slider_n`` that acts on it from outside. For a
rig with one joint that turns also ``u1``, ``p1_set_kpa``, ``p1_kpa``, ``force1_n``, ``angle_deg``,
``torque_nm``: muscles by number. Pressures are gauge.

A log in a lab's own columns and units is read as it is if ``recording.toml`` says what they are,
see `pamsim.recordings.log_columns`.
"""

from __future__ import annotations

import hashlib
import itertools
import os
import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from pamsim.core.errors import InputError, first_few
from pamsim.core.limits import HEAVIEST_LOAD
from pamsim.core.toml_tables import NUMBER, Entry, check_table, read_toml
from pamsim.recordings import recording_checks, segments
from pamsim.recordings.columns import Columns
from pamsim.recordings.log_columns import in_own_format
from pamsim.recordings.recording import SCHEMA
from pamsim.recordings.signals import (
    DRIVES,
    EFFORTS,
    ENDINGS,
    JOINT_KINDS,
    MUSCLE_DRIVES,
    NUMBERED,
    Drive,
    DriveLike,
    column_of,
    command_columns,
    muscle_channels,
)
from pamsim.recordings.stated_noise import stated_noise
from pamsim.recordings.table_reader import read_columns
from pamsim.recordings.trial import Trial, TrialSet

INDEX = "recording.toml"
WITH_COLUMNS = "pamsim-recording/2"
_NUMBERED = ("time_s", "angle_deg", "torque_nm", *dict.fromkeys(NUMBERED.values()))
_BY_NUMBER = re.compile(r"u\d+|p\d+(_set)?_kpa")

_TOP = {
    "schema": Entry(),
    "rig": Entry(write='"...", the name or path of the rig it is of'),
    "columns": Entry(object, default=None),
    "noise": Entry(object, default=None),
    "trial": Entry(object, default=None),
}
_TRIAL = {
    "file": Entry(),
    "protocol": Entry(),
    "drive": Entry(
        str | Mapping,
        f'"...", of {", ".join(MUSCLE_DRIVES)}, or a table with one for each muscle and driven'
        " joint",
        holds=bool,
    ),
    "load_kg": Entry(NUMBER, "the mass on the arm, 0 for none", 0.0, lambda load: load >= 0.0),
    **segments.ENTRIES,
}


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
    read: list[_Read] = []
    trials: list[Trial] = []
    notes: list[str] = []
    for number, one in enumerate(table["trial"], start=1):
        own = table["columns"] is not None
        columns = read_columns(index.parent / one["file"], numbers_only=own)
        if own:
            columns = in_own_format(columns, table["columns"], f"{index}: [columns]")
        read.append(_trial(one, columns, notes))
        trials += segments.trials_of(read[-1].trial, one, f"{index}: trial {number}")
    for name, count in Counter(trial.name for trial in trials).items():
        if count > 1:
            raise InputError(f"{index}: two trials are called {name!r}; rename one of the files")
    if table["columns"] is None:  # a log states its units itself, and bellows work at a few kPa
        recording_checks.units_of_all([one.columns for one in read])
    first, of_first = _muscles(read[0].trial), read[0].columns.path.name
    for one in read:
        if _muscles(one.trial) != first:
            raise InputError(
                f"{one.columns.path}: commands {_muscles(one.trial)}, {of_first} {first}; a"
                " recording is of one rig"
            )
    notes += [*_uneven(read), *_copies(trials)]
    unmeasured: list[str] = []
    for channel in dict.fromkeys(channel for one in read for channel in one.channels):
        missing = [trial.name for trial in trials if channel not in trial.measured]
        if missing:
            where = "any trial" if len(missing) == len(trials) else ", ".join(missing)
            unmeasured.append(f"{channel} was not measured in {where}")
    if table["noise"] is not None:
        measured = [channel for trial in trials for channel in trial.measured]
        noise = stated_noise(table["noise"], measured, f"{index}: [noise]")
        trials = [
            replace(trial, noise={c: noise[c] for c in trial.measured if c in noise})
            for trial in trials
        ]
    # A path is relative to the recording; `pamsim.load_rig` finds it from anywhere.
    # Joined as text: a folder in "." stays a path, which the name of a shipped rig is not.
    beside = os.path.join(index.parent, table["rig"])
    rig = beside if os.path.isfile(os.path.join(beside, "params.toml")) else table["rig"]
    return TrialSet(rig=rig, trials=tuple(trials), notes=(*unmeasured, *notes, *_unused(read)))


class _Read(NamedTuple):
    """A trial of a file, its known columns, channels, columns not used, and note on its clock."""

    trial: Trial
    columns: Columns
    channels: Collection[str]
    unused: tuple[str, ...]
    jitter: str


def _uneven(read: Sequence[_Read]) -> list[str]:
    """What is said of clocks that are not uniform, once for all files."""
    uneven = [one for one in read if one.jitter]
    if not uneven:
        return []
    names = first_few([one.trial.name for one in uneven], 1)
    return [f"{names}: {uneven[0].jitter}; `rate` in [[trial]] makes an even one"]


def _copies(trials: Sequence[Trial]) -> list[str]:
    """Trials whose measurements are those of another, to the last digit."""
    first: dict[bytes, str] = {}
    found: list[str] = []
    for trial in trials:
        digest = hashlib.sha256(trial.time.tobytes())
        for channel in sorted(trial.measured):
            digest.update(channel.encode() + trial.measured[channel].tobytes())
        name = first.setdefault(digest.digest(), trial.name)
        if name != trial.name:
            found.append(f"{trial.name} is a copy of {name}, to the last digit, and no repeat")
    return found


def _unused(read: Sequence[_Read]) -> list[str]:
    """Columns that are not used, once for all files that have the same."""
    files: dict[tuple[str, ...], list[str]] = {}
    for one in read:
        files.setdefault(one.unused, []).append(one.trial.name)
    return [
        f"{', '.join(names) if len(names) < len(read) else 'every file'}: not used:"
        f" {', '.join(map(repr, columns))}"
        for columns, names in files.items()
        if columns
    ]


def _muscles(trial: Trial) -> str:
    return ", ".join(sorted(trial.muscle_names)) or f"{trial.muscles} muscles"


def _index(path: Path) -> Mapping[str, Any]:
    try:
        index = check_table(read_toml(path, SCHEMA, WITH_COLUMNS), _TOP, path)
    except FileNotFoundError:
        raise InputError(
            f"no recording at {path.parent if path.name == INDEX else path}: give a folder with"
            f" {INDEX}, as `pamsim import LOG --rig RIG --out FOLDER` writes it"
        ) from None
    if not isinstance(index["trial"], list) or not index["trial"]:
        raise InputError(f"{path}: no trial; write [[trial]] with file, protocol, drive, load_kg")
    index["trial"] = [
        _checked(one, f"{path}: trial {number}") for number, one in enumerate(index["trial"], 1)
    ]
    for file in dict.fromkeys(one["file"] for one in index["trial"]):
        own, where = [one for one in index["trial"] if one["file"] == file], f"{path}: {file}"
        if len(own) > 1:
            _named_apart(own, where)
        _refuse_overlap(own, where)
    _refuse_same(path, [one["file"] for one in index["trial"]])
    return index


def _refuse_same(index: Path, files: Sequence[str]) -> None:
    """Refuse one file under two names, also of links: a log is no repeat of itself."""
    names: dict[tuple[int, int], str] = {}
    for file in files:
        try:
            own = os.stat(index.parent / file)
        except OSError:  # described where it is read
            continue
        first = names.setdefault((own.st_dev, own.st_ino), file)
        if first != file:
            raise InputError(f"{index}: {file} is the same file as {first}; name each log once")


def _named_apart(entries: list[dict[str, Any]], where: str) -> None:
    """Name the trials of one file by their protocols."""
    for one in entries:
        if not one["segments"]:
            raise InputError(f"{where} is several trials; give each its segments")
        one["name"] = f"{Path(one['file']).with_suffix('').as_posix()}_{one['protocol']}"
    if len({one["name"] for one in entries}) < len(entries):
        raise InputError(f"{where} has two trials of one protocol; list all segments in one")


def _refuse_overlap(entries: Sequence[Mapping[str, Any]], where: str) -> None:
    """Refuse segments of one file that share rows: repeats must be independent."""
    each = (segments.spans_of(one["segments"] or [], f"{where}: segments") for one in entries)
    spans = sorted(itertools.chain.from_iterable(each))
    for (_, end), (begin, _) in itertools.pairwise(spans):
        if begin < end:
            raise InputError(f"{where}: segments overlap at {begin:g} s; move an end")


def _checked(table: object, where: str) -> dict[str, Any]:
    entry = check_table(table, _TRIAL, where)
    try:
        Drive.of(entry["drive"], len(entry["drive"]))
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    load: float = entry["load_kg"]
    if load > HEAVIEST_LOAD:
        raise InputError(f"{where}: load_kg = {load:g} is no load for an arm; write kg, not g")
    return entry


def _trial(table: Mapping[str, Any], columns: Columns, notes: list[str]) -> _Read:
    """The trial of an entry, with what its file has; what else to know is added to the notes."""
    drive: DriveLike = table["drive"]
    muscles = _named_muscles(columns, drive)
    if not muscles:
        columns = columns.select(_NUMBERED)
    # A muscle whose pressure was measured must be commanded, too.
    numbers = [int(number) for number in re.findall(r"\d+", " ".join(columns.cells))]
    if drive == "sealed" and not muscles and not numbers:
        raise InputError(
            f"{table['file']}: drive = 'sealed', and no column gives the pressure of a muscle, from"
            " which its air is known; record that of each, as p1_kpa or NAME_kpa"
        )
    count = len(muscles) or max([1, *numbers])
    drives = Drive.of(drive, count if isinstance(drive, str) else len(drive))
    command = command_columns(drives, muscles)
    short = ("angle", "torque") if drives.joints else ("angle",)
    joints = _joints(columns, drives) if muscles else short
    pressures, forces = (
        muscle_channels(kind, muscles, len(drives.muscles)) for kind in ("pressure", "force")
    )
    channels = {column_of(channel): channel for channel in (*pressures, *joints, *forces)}
    if muscles:
        known = (column_of(c) for q in NUMBERED for c in muscle_channels(q, muscles, count))
        columns = columns.select(("time_s", *filter(None, command), *channels, *known))
    columns.require("time_s")
    driven = [(column, k) for column, k in zip(command, drives.kinds, strict=True) if column]
    for column, kind in driven:
        why = (
            f", which drive = {kind!r} needs: what drives the simulation must be recorded, or"
            " stated by a schedule"
        )
        columns.require(column, why, "no command column")
        if kind in EFFORTS.values():  # from outside, which is no measurement of the rig
            channels.pop(column, None)
    name = table.get("name") or Path(table["file"]).with_suffix("").as_posix()
    jitter = recording_checks.clock(columns)
    if table["rate"] is not None:  # which puts it on an even clock
        jitter = ""
    recording_checks.units(columns, driven)
    used = {"time_s", *command, *channels}
    notes += [f"{name}: {note}" for note in columns.notes if note]
    unused = (*columns.ignored, *(column for column in columns.cells if column not in used))
    time = columns.values["time_s"]
    trial = Trial(
        name=name,
        protocol=table["protocol"],
        drive=drive,
        load=float(table["load_kg"]),
        time=time - time[0],
        command=np.column_stack([columns.si(c) if c else np.zeros(time.size) for c in command]),
        measured={channels[c]: columns.si(c) for c in channels if c in columns.cells},
        muscle_names=muscles,
        turned=frozenset(channels[c] for c in channels if c in columns.turned),
    )
    return _Read(trial, columns, channels.values(), unused, jitter)


def _named_muscles(columns: Columns, drive: DriveLike) -> tuple[str, ...]:
    """Names of the muscles: those of the drive, or of columns that hold it; none if by number."""
    if not isinstance(drive, str):
        names = tuple(name for name, kind in drive.items() if kind in MUSCLE_DRIVES)
    else:
        ending = ENDINGS[MUSCLE_DRIVES[drive].quantity or "pressure"]
        found = [re.fullmatch(f"(.+?)_{ending}", name) for name in columns.cells]
        names = tuple(match[1] for match in found if match and not match[1].endswith("_set"))
    by_name = any(cell.startswith(f"{muscle}_") for muscle in names for cell in columns.cells)
    return names if by_name and not any(map(_BY_NUMBER.fullmatch, columns.cells)) else ()


def _joints(columns: Columns, drives: Drive) -> tuple[str, ...]:
    """Channels of joints by name: of those that turn or slide, and of what acts on them."""
    ends = {kind: f"_{ENDINGS[kind]}" for kind in (*JOINT_KINDS, "torque")}
    return (
        *(
            f"{name.removesuffix(end)}.{kind}"
            for kind, end in ends.items()
            for name in columns.cells
            if name.endswith(end)
        ),
        *(f"{j}.force" for j, kind in drives.joints.items() if DRIVES[kind].of == "position"),
    )
