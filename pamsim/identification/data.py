"""Data to identify from: a recording, a plain CSV, or a simulated step."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pamsim.core.errors import InputError, nearest
from pamsim.core.experiment import pressure_step
from pamsim.core.recording import Recording
from pamsim.core.trial import Trial, TrialSet
from pamsim.engine.rig import load_rig
from pamsim.engine.simulate import simulate
from pamsim.identification.signals import SignalTable, table_of
from pamsim.store.columns import read_columns
from pamsim.store.recording_reader import read_recordings

_FEW_VALUES = 0.1  # share of distinct values up to which a column counts as held from row to row


@dataclass(frozen=True, kw_only=True)
class IdentifyData:
    """Trials to identify from.

    Attributes:
        source: path, or the simulation in words.
        rig: name or path of the rig; empty if unknown.
        tables: one per trial.
        notes: what a reader should know.
    """

    source: str
    rig: str
    tables: tuple[SignalTable, ...]
    notes: tuple[str, ...]


def load_data(data: str | os.PathLike[str] | TrialSet) -> IdentifyData:
    """Read what is to be identified.

    Args:
        data: folder of a recording or its ``recording.toml``; a CSV with ``time_s`` and any other
            columns; or trials.

    Raises:
        InputError: as `pamsim.store.recording_reader.read_recordings`.
    """
    if not isinstance(data, TrialSet):
        path = Path(data)
        if path.suffix.lower() == ".csv":
            return _plain(path)
        source, data = str(path), read_recordings(path)
    else:
        source = f"{', '.join(trial.name for trial in data.trials)} of {data.rig}"
    tables = tuple(table_of(trial) for trial in data.trials)
    return IdentifyData(source=source, rig=data.rig, tables=tables, notes=data.notes)


def select_trials(
    data: IdentifyData, trials: Sequence[str], protocols: Sequence[str], hold_out: Sequence[str]
) -> tuple[list[SignalTable], list[SignalTable]]:
    """Trials to fit and trials to hold out.

    Args:
        data: all of them.
        trials: names to use; all if empty.
        protocols: protocols to use; all if empty.
        hold_out: names to exclude from the fit.

    Raises:
        InputError: for an unknown name, or if nothing is left to fit.
    """
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


def simulated_step(
    rig: str,
    *,
    pressure: Sequence[float] = (487e3, 0.0),
    load: float = 0.0,
    duration: float = 6.0,
) -> TrialSet:
    """A large step of a rig: all muscles rest at the highest set point, then take their own.

    Args:
        rig: name of a shipped rig, or path of a rig folder.
        pressure: set points after the step, gauge [Pa].
        load: mass on the arm [kg].
        duration: [s].

    Raises:
        InputError: as `pamsim.simulate`.
        SimulationError: if the run broke down.
    """
    loaded = load_rig(rig)
    start = [max(pressure)] * len(pressure)
    step = pressure_step(start, pressure, duration=duration, load=load, name="simulated step")
    run = simulate(loaded, step).completed()
    return TrialSet(rig=loaded.name, trials=(_trial_of(run, "simulated_step"),))


def _trial_of(run: Recording, name: str) -> Trial:
    return Trial(
        name=name,
        protocol=name,
        drive=run.drive,
        load=run.load,
        time=run.time,
        command=run.command,
        measured=run.signals(),
        muscle_names=run.names.named_muscles,
    )


def _plain(path: Path) -> IdentifyData:
    """A log of any columns: those of few distinct values are taken as held commands."""
    table = read_columns(path)
    table.require("time_s")
    columns = {name: table.si(name) for name in table.cells}
    time = columns.pop("time_s")
    held = frozenset(
        name
        for name, values in columns.items()
        if np.unique(values).size <= max(2, _FEW_VALUES * values.size)
    )
    table = SignalTable(
        name=path.stem,
        protocol=path.stem,
        load=0.0,
        time=time - time[0],
        columns=columns,
        held=held,
        rest={name: float(columns[name][0]) for name in held},
        level=None,
    )
    notes = (f"assumed to be held from row to row: {', '.join(sorted(held)) or 'no column'}",)
    return IdentifyData(source=str(path), rig="", tables=(table,), notes=notes)
