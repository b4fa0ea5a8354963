"""Make a recording of a lab's own log: the file as it lies, and a table of what its columns are."""

from __future__ import annotations

import math
import os
import re
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

from pamsim.comparison.joined_logs import join_each, join_logs, with_schedule, without_number
from pamsim.comparison.joint_signs import turned_joints
from pamsim.comparison.repeats import samples_per_period
from pamsim.core.encoding import fields_to_dict
from pamsim.core.errors import InputError, nearest, refuse_unknown
from pamsim.core.files import complete_file, refuse_existing
from pamsim.core.units import parse_quantity
from pamsim.engine.rig import Rig, load_rig
from pamsim.recordings.column_guess import Guess, guess_columns, unit_of
from pamsim.recordings.recording_reader import INDEX, WITH_COLUMNS, read_recordings
from pamsim.recordings.rig_file import shipped_rigs
from pamsim.recordings.signals import (
    EFFORTS,
    JOINT_DRIVES,
    MUSCLE_DRIVES,
    NUMBERED,
    DriveLike,
    checked,
    in_toml,
)
from pamsim.recordings.table_reader import read_columns
from pamsim.recordings.trial import Trial, of_rig

Spans: TypeAlias = Sequence[tuple[float, float]]
"""Begin and end of parts of a log [s]."""

PathOrPaths: TypeAlias = str | os.PathLike[str] | Sequence[str | os.PathLike[str]]


_FACTOR = re.compile(r"(.+?)\*(\s*[+-]?\.?\d.*|[^*]*)")
"""Name of a column and its factor, whose unit may be a product itself: ``I*0.35N*m/A``."""


@dataclass(frozen=True, kw_only=True)
class ImportedLog:
    """What a log was taken for.

    Attributes:
        folder: of the recording.
        rig: its name.
        rows: of the log from which the columns were guessed.
        columns: what each used column is.
        unused: column -> why it is not used.
        drive: what drives the simulation.
        trials: names of the recording's trials.
        seconds: of all trials together.
        notes: what else to know, one sentence each.
    """

    folder: Path
    rig: str
    rows: int
    columns: tuple[Guess, ...]
    unused: dict[str, str]
    drive: DriveLike
    trials: tuple[str, ...]
    seconds: float
    notes: tuple[str, ...]

    def summary(self) -> str:
        """What was understood, as a few lines for a screen."""
        wide = max(len(one.column) for one in self.columns)
        lines = [f"rig {self.rig}, {self.rows} rows"]
        for one in self.columns:
            turned = ", sign reversed" if one.sign < 0 else ""
            absolute = ", absolute" if one.absolute else ""
            times = f" times {one.times}" if one.times else ""
            lines.append(
                f"  {one.column:{wide}s}  is {one.quantity} in {one.unit}{times}{absolute}{turned}"
            )
        lines += [f"not sure: {one.column}: {'; '.join(one.warnings)}" for one in self.columns
                  if one.warnings]  # fmt: skip
        by_reason: dict[str, list[str]] = {}
        for column, why in self.unused.items():
            by_reason.setdefault(why, []).append(column)
        lines += [f"not used, {why}: {', '.join(names)}" for why, names in by_reason.items()]
        each = {} if isinstance(self.drive, str) else self.drive
        driven = ", ".join(f"{muscle} {kind}" for muscle, kind in each.items()) or self.drive
        lines.append(f"driven by: {driven}")
        lines.append(f"trials: {len(self.trials)}, {self.seconds:.4g} s")
        lines += [f"note: {note}" for note in self.notes]
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """The same as JSON-safe values."""
        return {"schema": "pamsim-import/1", **fields_to_dict(self), "folder": str(self.folder)}


def import_log(
    logs: PathOrPaths,
    *,
    rig: str | os.PathLike[str] | Rig,
    out: str | os.PathLike[str],
    beside: PathOrPaths = (),
    shared: str = "",
    offset: str = "",
    schedule: PathOrPaths = (),
    columns: Sequence[str] = (),
    drive: str = "",
    protocol: str | Sequence[str] = "",
    ignore: Sequence[str] = (),
    rate: str = "",
    wraps: str = "",
    period: str = "",
    segments: Spans | Mapping[str, Spans] = (),
    lead_in: str = "",
    load: float = 0.0,
    force: bool = False,
) -> ImportedLog:
    """Make a recording of logs in a lab's own columns and units.

    Args:
        logs: CSV, MAT, npz or Parquet files with the same columns; each is copied as it lies.
            Columns without header are ``column_1`` and so on.
        rig: name or folder of the rig they are of, or a loaded one.
        out: folder to write.
        beside: of each log, what another logger recorded meanwhile with a clock of its own; both
            become one table on the clock of the log.
        shared: columns of both that hold one signal, ``sync=trigger``, by which the clocks' offset
            is found.
        offset: or what a log's clock shows when the other is at 0, such as ``1.25 s``; without
            another log, when a schedule is.
        schedule: of each log, or of all, a table of what was commanded when, if that was not
            logged: times, and a column for each muscle; each row holds until the next.
        columns: what is known of some, ``knee.angle=-phi:deg`` or ``knee.torque=F*0.0069m:N``:
            quantity, sign, name and, if known, a factor and the unit; the others are guessed. What
            is known of a clock applies to all tables with a column of its name.
        drive: what drives the simulation, one of `pamsim.recordings.signals.MUSCLE_DRIVES`; if
            left out what was commanded, and the measured pressure of a muscle if nothing was.
        protocol: of all logs, which makes them repeats, or one for each; the file's name without a
            number at its end if left out.
        ignore: columns to leave out that would be taken for something.
        rate: such as ``200 Hz``: of the rows of a log without a clock; a log with one is put on an
            even clock of that rate.
        wraps: such as ``2 s``, after which a log's clock begins again at 0.
        period: such as ``9.93 s``, in which one log repeats.
        segments: begin and end of each trial in one log [s]; or such pairs by protocol.
        lead_in: such as ``2 s``, simulated before each trial and not compared.
        load: mass on the arm [kg].
        force: replace files that are there.

    Returns:
        What each column was taken for.

    Raises:
        InputError: for a log that cannot be read, nothing that drives a muscle, or a file that is
            there already.
    """
    files, loaded, folder = _paths(logs), rig if isinstance(rig, Rig) else load_rig(rig), Path(out)
    stated = [_stated(text, loaded) for text in columns]
    protocols = [protocol] * len(files) if isinstance(protocol, str) else list(protocol)
    if len(protocols) != len(files):
        raise InputError(f"{len(files)} logs and {len(protocols)} `protocol`; give one for each")
    protocols = [o or without_number(f.stem) for o, f in zip(protocols, files, strict=True)]
    again = parse_quantity(wraps, "s", "s", where="`wraps`") if wraps else 0.0
    if wraps and not 0.0 < again < math.inf:
        raise InputError(f"`wraps` {wraps}: it must be above 0 s")
    with tempfile.TemporaryDirectory() as scratch, _naming(f"{scratch}{os.sep}", ""):
        known = {"names": loaded.names, "wraps": again}
        found_out: list[str] = []
        if beside or shared or (offset and not schedule):
            second = _paths(beside)
            join = partial(
                join_logs, **known, stated=stated, shared=shared, offset=_seconds(offset)
            )
            files, found_out = join_each(
                files, second, Path(scratch), join, what="`beside` them", name="{}_and_{}"
            )
            stated, offset = _still_there(stated, second[0], files[0]), ""
        if schedule:
            second = _paths(schedule)
            every = parse_quantity(rate, "Hz", "Hz", where="`rate`") if rate else None
            begin = _seconds(offset) or 0.0
            join = partial(with_schedule, **known, stated=stated, offset=begin, rate=every)
            second = second * len(files) if len(second) == 1 else second
            files, commanded = join_each(
                files, second, Path(scratch), join, what="`schedule`", name="{}_commanded"
            )
            found_out += commanded
            stated = _still_there(stated, second[0], files[0])
        table = read_columns(files[0], numbers_only=True)
        guesses, unused = guess_columns(
            table, loaded.names, supply=loaded.supply_pressure, stated=stated, ignore=ignore
        )
        clock = next((one for one in guesses if one.quantity == "time"), None)
        if clock and again:
            wrapped = replace(clock, wraps=again / clock.seconds(clock.column))
            guesses = tuple(wrapped if one is clock else one for one in guesses)
        if not clock and not rate:
            raise InputError(
                f"{files[0]}: no clock among {', '.join(table.cells)}; name it, such as `columns`"
                " time=t:s, or give `rate`"
            )
        if not clock and wraps:
            raise InputError(
                f"{_paths(logs)[0]}: `wraps` {wraps} needs a clock, and `rate` replaces it; name"
                " the clock, such as `columns` time=t:s, or leave `wraps` out"
            )
        kind = _drive(drive, loaded, [one.quantity for one in guesses], files[0])
        asked = {"rate": rate if clock else "", "period": period, "lead_in": lead_in}
        cut = {key: text for key, text in asked.items() if text}
        parts = (segments if isinstance(segments, Mapping) else {"": segments}) or {"": ()}
        entries = [
            {
                "file": file.name,
                "protocol": own or name,
                "drive": kind,
                "load_kg": float(load),
                **cut,
                **({"segments": [list(map(float, pair)) for pair in spans]} if spans else {}),
            }
            for file, name in zip(files, protocols, strict=True)
            for own, spans in parts.items()
        ]

        def write(index: Path, chosen: Sequence[Guess]) -> tuple[Trial, ...]:
            text = _index(_rig_from(loaded, folder), "" if clock else rate, chosen, entries)
            index.write_text(text, encoding="utf-8")
            with _naming(str(index), str(folder / INDEX)):
                found = read_recordings(index)
            return tuple(of_rig(trial, loaded.names, loaded.name)[0] for trial in found.trials)

        # The index is there once it is right, not while a sign in it may still be turned.
        with _copied(files, folder, force), complete_file(folder / INDEX) as index:
            trials = write(index, guesses)
            turned = turned_joints(guesses, [one.quantity for one in stated], trials, loaded)
            if turned != guesses:
                trials = write(index, turned)
    return ImportedLog(
        folder=folder,
        rig=loaded.name,
        rows=len(table.lines),
        columns=turned,
        unused=unused,
        drive=kind,
        trials=tuple(trial.name for trial in trials),
        seconds=float(sum(trial.time[-1] for trial in trials)),
        notes=(
            *dict.fromkeys(found_out),
            *table.notes,
            *_notes(trials, kind, bool(cut or segments)),
        ),
    )


@contextmanager
def _naming(place: str, name: str) -> Iterator[None]:
    """Errors name a file as the user knows it, not where it is written meanwhile."""
    try:
        yield
    except InputError as error:
        raise InputError(str(error).replace(place, name)) from None


def _still_there(stated: Sequence[Guess], second: Path, joined: Path) -> list[Guess]:
    """What is stated, without the clock of a second table: joined ones have the log's."""
    gone = read_columns(second, numbers_only=True).cells.keys() - read_columns(joined).cells.keys()
    return [one for one in stated if one.quantity != "time" or one.column not in gone]


@contextmanager
def _copied(files: Sequence[Path], folder: Path, force: bool) -> Iterator[None]:
    """Logs as they lie in a recording's folder; what is new there is removed if it is refused."""
    targets = {folder / file.name: file for file in files}
    if len(targets) < len(files):
        raise InputError(f"{folder}: two logs have the same name; rename one")
    moved = {t: f for t, f in targets.items() if not (t.exists() and t.samefile(f))}
    written = (*moved, folder / INDEX)
    new = [path for path in written if not path.exists()]
    for path in written:
        refuse_existing(path, force)
    try:
        for target, file in moved.items():
            with complete_file(target) as copy:
                shutil.copyfile(file, copy)
        yield
    except InputError:
        for path in new:
            path.unlink(missing_ok=True)
        raise


def _seconds(offset: str) -> float | None:
    return parse_quantity(offset, "s", "s", where="`offset`") if offset else None


def _paths(given: PathOrPaths) -> list[Path]:
    return [Path(one) for one in ([given] if isinstance(given, str | os.PathLike) else given)]


def _stated(text: str, rig: Rig) -> Guess:
    """What the user states of a column: ``knee.angle=-phi:deg``, ``knee.torque=F*0.0069m:N``."""
    quantity, equals, column = (part.strip() for part in text.partition("="))
    if not equals or not column:
        raise InputError(
            f"`columns` {text}: write quantity=name, quantity=name:unit or"
            " quantity=name*factor:unit"
        )
    known = [
        "time",
        *(f"{joint}.{kind}" for joint, kind in rig.joints.items()),
        *(f"{joint}.{EFFORTS[kind]}" for joint, kind in rig.joints.items()),
        *(f"{muscle}.{of_muscle}" for muscle in rig.muscles for of_muscle in NUMBERED),
    ]
    refuse_unknown(quantity, known, f"`columns` {text}: rig {rig.name!r} has no {quantity!r}")
    name, colon, unit = column.removeprefix("-").rpartition(":")
    if not colon:
        name, unit = unit, ""
    unit, absolute = unit_of(unit)
    factor = _FACTOR.fullmatch(name)
    name, times = factor.groups() if factor else (name, "")
    return Guess(
        quantity=quantity,
        column=name.strip(),
        unit=unit,
        sign=-1 if column.startswith("-") else 1,
        absolute=absolute,
        times=times.strip(),
    )


def _drive(wanted: str, rig: Rig, quantities: Sequence[str], where: Path) -> DriveLike:
    """Drive that the columns allow: the same of all muscles if possible, and torques on joints."""
    stated: dict[str, str] = {}
    for part in wanted.split(",") if "=" in wanted else ():
        name, _, own = part.partition("=")
        stated[name.strip()] = own.strip()
    for name, own in stated.items():
        nearest_to = (*rig.muscles, *rig.joints)
        if name not in nearest_to:
            raise InputError(f"`drive` {name}={own}: {nearest(name, nearest_to)}")
        checked(own, MUSCLE_DRIVES if name in rig.muscles else JOINT_DRIVES)
    kinds = list(MUSCLE_DRIVES)[:-1]
    if wanted and not stated:
        kinds = [checked(wanted, MUSCLE_DRIVES)]
    usable = {
        muscle: [
            kind
            for kind in ([stated[muscle]] if muscle in stated else kinds)
            if kind == "sealed" or f"{muscle}.{MUSCLE_DRIVES[kind].quantity}" in quantities
        ]
        for muscle in rig.muscles
    }
    missing = [muscle for muscle, own in usable.items() if not own]
    if missing:
        what = MUSCLE_DRIVES[kinds[0]].quantity if len(kinds) == 1 else "pressure"
        raise InputError(
            f"{where}: nothing drives {', '.join(missing)}: each muscle needs a command or its"
            f" measured pressure; name the column, such as `columns` {missing[0]}.{what}=NAME:bar,"
            f" or state that it was shut: `drive` {missing[0]}=sealed beside the drives of the"
            " others"
        )
    if {"sealed"} == {kind for own in usable.values() for kind in own} and not any(
        f"{muscle}.pressure" in quantities for muscle in rig.muscles
    ):
        raise InputError(
            f"{where}: all muscles are sealed, and no column gives the pressure of one, from which"
            " its air is known; name that of each, such as `columns`"
            f" {next(iter(rig.muscles))}.pressure=NAME:bar"
        )
    common = [kind for kind in kinds if all(kind in own for own in usable.values())]
    of_muscles = {muscle: (common or own)[0] for muscle, own in usable.items()}
    of_joints = {
        joint: stated.get(joint, EFFORTS[kind])
        for joint, kind in rig.joints.items()
        if joint in stated or f"{joint}.{EFFORTS[kind]}" in quantities
    }
    if of_joints or len(set(of_muscles.values())) > 1:
        return {**of_muscles, **of_joints}
    return next(iter(of_muscles.values()))


def _rig_from(rig: Rig, folder: Path) -> str:
    """The rig as a recording in a folder names it: a shipped one by its name, others by path."""
    own = rig.file.folder.resolve()
    if own.parent == shipped_rigs().resolve():
        return own.name
    return Path(os.path.relpath(own, folder.resolve())).as_posix()


def _index(
    rig: str, rate: str, guesses: Sequence[Guess], entries: Sequence[Mapping[str, Any]]
) -> str:
    """Text of ``recording.toml``, with the rate of rows that have no clock."""
    lines = [f"schema = {in_toml(WITH_COLUMNS)}", f"rig = {in_toml(rig)}", "", "[columns]"]
    lines += [f"time = {{ rate = {in_toml(rate)} }}"] if rate else []
    for one in guesses:
        parts = [f"column = {in_toml(one.column)}", f"unit = {in_toml(one.unit)}"]
        parts += ["sign = -1"] if one.sign < 0 else []
        parts += ["absolute = true"] if one.absolute else []
        parts += [f"times = {in_toml(one.times)}"] if one.times else []
        parts += [f"wraps = {one.wraps:.12g}"] if one.wraps else []
        warnings = f"  # not sure: {'; '.join(one.warnings)}" if one.warnings else ""
        lines.append(f"{in_toml(one.quantity)} = {{ {', '.join(parts)} }}{warnings}")
    for entry in entries:
        lines += ["", "[[trial]]"]
        lines += [f"{key} = {in_toml(value)}" for key, value in entry.items()]
    return "\n".join(lines) + "\n"


def _notes(trials: Sequence[Trial], kind: DriveLike, cut: bool) -> tuple[str, ...]:
    """What to know of the trials: how one log may be cut into repeats."""
    if cut or len(trials) != 1 or kind == "measured":
        return ()
    (trial,) = trials
    lag = samples_per_period(trial.command)
    if lag is None:
        return ()
    seconds = float(trial.time[lag] - trial.time[0])
    count = int((trial.time[-1] + trial.sample_interval) / seconds)
    return (
        f"the command repeats every {seconds:.6g} s: `period` {seconds:.6g}s would make"
        f" repeats of it ({count} periods)",
    )
