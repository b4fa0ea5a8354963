"""Read static tables: the angles at which a rig came to rest, one row each.

Columns: ``p1_kpa``, ``p2_kpa`` ... (gauge, one per muscle, at rest), ``angle_deg`` (``beta_deg`` is
the same), and, if they are known, ``load_kg`` and the pressures before the step,
``start_p1_kpa``, ``start_p2_kpa`` ...
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.limits import HEAVIEST_LOAD
from pamsim.core.units import FloatArray
from pamsim.recordings import recording_checks
from pamsim.recordings.column_guess import names_a_clock
from pamsim.recordings.printed import distinct_steps
from pamsim.recordings.table_reader import read_columns

PRINTED = "mas20"
"""Name of the packaged table: the 21 distinct rows of Matiskova 2021, Tables 1 and 2."""

_STATIC_COLUMNS = ("p{}_kpa", "start_p{}_kpa", "angle_deg", "load_kg")


@dataclass(frozen=True, kw_only=True)
class StaticTable:
    """Angles at rest, in SI."""

    name: str  # of the file, or ``mas20``
    rows: tuple[str, ...]  # what to call each row
    pressure: FloatArray  # (n, m) gauge pressures at rest [Pa]
    load: FloatArray  # (n,) [kg]
    angle: FloatArray  # (n,) [rad]
    # (n, m) gauge pressures before the step [Pa], or None if the table has none
    start: FloatArray | None = None
    notes: tuple[str, ...] = ()  # what a reader should know, one sentence each


def read_static_table(source: str | os.PathLike[str]) -> StaticTable:
    """Read a static table, in SI: a CSV, or ``mas20`` for the packaged one.

    Raises:
        InputError: in one line with file, line and column: a clock, a missing or mistyped column, a
            cell that is no finite number, numbers that must be in another unit than their column
            says.
    """
    if str(source) == PRINTED and not Path(source).exists():
        steps = distinct_steps()
        return StaticTable(
            name=PRINTED,
            rows=tuple(f"row {step.row}" for step in steps),
            pressure=np.array([step.pressure for step in steps]),
            load=np.array([step.load for step in steps]),
            angle=np.array([step.angle for step in steps]),
        )
    table = read_columns(Path(source))
    if clock := next(filter(names_a_clock, table.cells), None):
        raise InputError(
            f"{table.path}: column {clock!r} is a clock: this is a log, not a table of angles at"
            f" rest. Make a recording of it: pamsim import {table.path} --rig RIG --out data; drop"
            " the column if each row is an angle at rest"
        )
    columns = table.select(_STATIC_COLUMNS)
    name, given = columns.path.name, columns.cells
    count = max(map(int, re.findall(r"\bp(\d+)_kpa", " ".join(given))), default=1)
    pressures = [f"p{i}_kpa" for i in range(1, count + 1)]
    for column in (*pressures, "angle_deg"):
        columns.require(
            column,
            ": a table of angles at rest needs p1_kpa, p2_kpa, angle_deg; of a log over time make a"
            " recording: pamsim import LOG --rig RIG --out FOLDER",
        )
    held = {name: v for name, v in columns.values.items() if name.endswith("_kpa")}
    recording_checks.units(columns, [(name, "pressure_set") for name in held])
    if loaded := "load_kg" in given:
        grams = "is no load for an arm; write kg, not g"
        columns.require_range("load_kg", 0.0, HEAVIEST_LOAD, "is negative", grams)
    top, highest = max((float(values.max()), name) for name, values in held.items())
    recording_checks.require_muscle_pressure(top, highest, columns.path)
    starts = [f"start_{column}" for column in pressures]
    there = [column for column in starts if column in given]
    if there and there != starts:
        raise InputError(
            f"{columns.path}: {', '.join(there)} alone: give all of {', '.join(starts)}"
        )
    left = ", ".join(map(repr, columns.ignored))
    notes = [f"{name}: not used: {left}"] if left else []
    notes += [] if loaded else [f"{name}: no column load_kg, so no load"]
    return StaticTable(
        name=columns.path.stem,
        rows=tuple(f"line {number}" for number in columns.lines),
        pressure=np.column_stack([columns.si(column) for column in pressures]),
        load=columns.si("load_kg") if loaded else np.zeros(len(columns.lines)),
        angle=columns.si("angle_deg"),
        start=np.column_stack([columns.si(column) for column in starts]) if there else None,
        notes=tuple(notes),
    )
