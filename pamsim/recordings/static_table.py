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
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.core.limits import HEAVIEST_LOAD
from pamsim.recordings.columns import Columns, read_columns
from pamsim.recordings.printed import distinct_steps

FloatArray = NDArray[np.float64]

PRINTED = "mas20"
"""Name of the packaged table: the 21 distinct rows of Matiskova 2021, Tables 1 and 2."""

_COLUMNS = ("p{}_kpa", "start_p{}_kpa", "angle_deg", "load_kg")
_HIGHEST_KPA = 5e3
_LEAST_KPA = 20.0


@dataclass(frozen=True, kw_only=True)
class StaticTable:
    """Angles at rest, in SI.

    Attributes:
        name: of the file, or ``mas20``.
        rows: what to call each row.
        pressure: (n, m) gauge pressures at rest [Pa].
        load: (n,) [kg].
        angle: (n,) [rad].
        start: (n, m) gauge pressures before the step [Pa], or None if the table has none.
        notes: what a reader should know, one sentence each.
    """

    name: str
    rows: tuple[str, ...]
    pressure: FloatArray
    load: FloatArray
    angle: FloatArray
    start: FloatArray | None = None
    notes: tuple[str, ...] = ()


def read_static_table(source: str | os.PathLike[str]) -> StaticTable:
    """Read a static table.

    Args:
        source: path of a CSV, or ``mas20`` for the packaged table.

    Raises:
        InputError: in one line with file, line and column: a missing or mistyped column, a cell
            that is no finite number, numbers that must be in another unit than their column says.
    """
    if str(source) == PRINTED and not Path(source).exists():
        return _printed()
    path = Path(source)
    columns = read_columns(path).select(_COLUMNS)
    numbers = [int(name[1:-4]) for name in columns.cells if re.fullmatch(r"p\d+_kpa", name)]
    muscles = range(1, max(numbers, default=1) + 1)
    for name in (*(f"p{i}_kpa" for i in muscles), "angle_deg"):
        columns.require(name, ": a table of angles at rest needs p1_kpa, p2_kpa, angle_deg")
    _plausible(columns)
    starts = [f"start_p{i}_kpa" for i in muscles]
    given = [name for name in starts if name in columns.cells]
    if given and given != starts:
        raise InputError(f"{path}: {', '.join(given)} alone: give all of {', '.join(starts)}")
    notes = [f"{path.name}: column {name!r} is not used" for name in columns.ignored]
    if "load_kg" not in columns.cells:
        notes.append(f"{path.name}: no column load_kg, so no load")
    rows = len(columns.lines)
    return StaticTable(
        name=path.stem,
        rows=tuple(f"line {number}" for number in columns.lines),
        pressure=np.column_stack([columns.si(f"p{i}_kpa") for i in muscles]),
        load=columns.si("load_kg") if "load_kg" in columns.cells else np.zeros(rows),
        angle=columns.si("angle_deg"),
        start=np.column_stack([columns.si(name) for name in starts]) if given else None,
        notes=tuple(notes),
    )


def _printed() -> StaticTable:
    steps = distinct_steps()
    return StaticTable(
        name=PRINTED,
        rows=tuple(f"row {step.row}" for step in steps),
        pressure=np.array([step.pressure for step in steps]),
        load=np.array([step.load for step in steps]),
        angle=np.array([step.angle for step in steps]),
    )


def _plausible(columns: Columns) -> None:
    values = columns.values
    pressures = [name for name in values if name.endswith("_kpa")]
    for name in pressures:
        low, high = int(np.argmin(values[name])), int(np.argmax(values[name]))
        if values[name][low] < 0.0:
            raise InputError(
                f"{columns.where(name, low)} is negative; pressures are gauge, and a muscle has no"
                " vacuum"
            )
        if values[name][high] > _HIGHEST_KPA:
            raise InputError(
                f"{columns.where(name, high)} is too much for a muscle; if it is Pa, divide it by"
                " 1000"
            )
    top = max(float(values[name].max()) for name in pressures)
    if 0.0 < top < _LEAST_KPA:
        raise InputError(
            f"{columns.path}: no pressure is above {top:g}, too little for a muscle; if the columns"
            " hold bar, multiply them by 100"
        )
    for name, most, why in (
        ("angle_deg", 360.0, "is more than a turn; the column must hold deg"),
        ("load_kg", HEAVIEST_LOAD, "is no load for an arm; write kg, not g"),
    ):
        if name not in values:
            continue
        row = int(np.argmax(np.abs(values[name])))
        if abs(values[name][row]) > most:
            raise InputError(f"{columns.where(name, row)} {why}")
        low = int(np.argmin(values[name]))
        if name == "load_kg" and values[name][low] < 0.0:
            raise InputError(f"{columns.where(name, low)} is negative")
