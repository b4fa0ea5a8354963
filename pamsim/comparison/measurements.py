"""Measurements of a rig: trials over time and angles at rest, from any number of files."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from pamsim.comparison.aligned_logs import aligned
from pamsim.core.errors import InputError, refuse_unknown
from pamsim.engine.rig import Rig
from pamsim.recordings.recording_reader import read_recordings
from pamsim.recordings.static_table import PRINTED, StaticTable, read_static_table
from pamsim.recordings.trial import Trial, of_rig


@dataclass(frozen=True, kw_only=True)
class CalibrationData:
    """Measurements of one rig."""

    sources: tuple[str, ...]  # where they were read from, as given
    rig: str | None  # name or path of the rig the recordings belong to, or None if there are none
    trials: tuple[Trial, ...]  # over time
    tables: tuple[StaticTable, ...]  # of angles at rest
    notes: tuple[str, ...] = ()  # what a reader should know, one sentence each

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all trials and tables."""
        return tuple(part.name for part in (*self.trials, *self.tables))

    def of_rig(self, rig: Rig) -> CalibrationData:
        """The same with the trials' channels and commands as a rig names and orders them.

        Logs of one input that begin and end at other rows are cut to those that all have.

        Raises:
            InputError: as `pamsim.recordings.trial.of_rig`.
        """
        found = [of_rig(trial, rig.names, rig.name) for trial in self.trials]
        notes = [note for _, own in found for note in own]
        trials, cut = aligned([trial for trial, _ in found])
        return replace(self, trials=trials, notes=(*self.notes, *notes, *cut))


def read_calibration_data(sources: Sequence[str | os.PathLike[str]]) -> CalibrationData:
    """Read recordings and static tables.

    Each source is a recording's folder or its ``recording.toml``, the CSV of a static table, or
    ``mas20`` for the packaged one.

    Raises:
        InputError: for what cannot be read, recordings of different rigs, or two static tables of
            the same name.
    """
    if not sources:
        raise InputError("no data: give the folder of a recording, or the CSV of a table at rest")
    trials: list[Trial] = []
    tables: list[StaticTable] = []
    notes: list[str] = []
    noted: list[tuple[str, Sequence[str]]] = []
    rigs: dict[str, tuple[str, str]] = {}  # as `_known_by` -> source, and rig as it is named there
    recordings = [s for s in sources if Path(s).is_dir() or Path(s).suffix == ".toml"]
    for source in sources:
        if source not in recordings:
            if not (Path(source).exists() or source == PRINTED):
                raise InputError(
                    f"no data at {source}: give the folder of a recording, as `pamsim import`"
                    " writes it, or the CSV of a table at rest"
                )
            table = read_static_table(source)
            tables.append(table)
            notes += table.notes
            continue
        recording = read_recordings(source)
        rigs.setdefault(_known_by(recording.rig), (str(source), recording.rig))
        # Trials of two recordings may well have the same file names.
        path = Path(source).resolve()
        folder = path if path.is_dir() else path.parent
        stem = f"{folder.name}/" if len(recordings) > 1 else ""
        trials += [
            replace(trial, name=f"{stem}{trial.name}", protocol=f"{stem}{trial.protocol}")
            for trial in recording.trials
        ]
        noted.append((stem, recording.notes))
    # What holds for every recording is noted once.
    shared = {note for _, own in noted for note in own if all(note in other for _, other in noted)}
    notes += dict.fromkeys(
        note if note in shared else f"{stem}{note}" for stem, own in noted for note in own
    )
    if len(rigs) > 1:
        pairs = " and ".join(f"{source} of {rig!r}" for source, rig in rigs.values())
        raise InputError(f"the recordings are of different rigs: {pairs}; calibrate one at a time")
    data = CalibrationData(
        sources=tuple(str(source) for source in sources),
        rig=next((rig for _, rig in rigs.values()), None),
        trials=tuple(trials),
        tables=tuple(tables),
        notes=tuple(notes),
    )
    for name in data.names:
        if data.names.count(name) > 1:
            raise InputError(f"{name!r} is given twice; rename one of the files or their folders")
    return data


def _known_by(rig: str) -> str:
    """A folder has many paths, such as one relative to each of its recordings."""
    folder = Path(rig)
    return str(folder.resolve()) if (folder / "params.toml").is_file() else rig


def split_held_out(
    data: CalibrationData, names: Sequence[str]
) -> tuple[CalibrationData, CalibrationData]:
    """Fitted data, and those of trials, protocols or tables whose names are held out.

    Raises:
        InputError: for an unknown name, or if nothing is left to fit.
    """
    known = {*data.names, *(trial.protocol for trial in data.trials)}
    for name in names:
        refuse_unknown(name, known, f"`hold_out` {name}: no trial of that name")

    def part(held: bool) -> CalibrationData:
        return replace(
            data,
            trials=tuple(
                t for t in data.trials if (t.name in names or t.protocol in names) == held
            ),
            tables=tuple(t for t in data.tables if (t.name in names) == held),
        )

    fitted = part(False)
    if not fitted.names:
        raise InputError("`hold_out` leaves nothing to fit; hold out fewer trials")
    return fitted, part(True)
