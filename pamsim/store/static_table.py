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

from pamsim.core.errors import InputError, nearest
from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA
from pamsim.store.csv_cells import csv_rows, finite_cell
from pamsim.store.printed import distinct_steps

FloatArray = NDArray[np.float64]

PRINTED = "mas20"
"""Name of the packaged table: the 21 distinct rows of Matiskova 2021, Tables 1 and 2."""

_ALIASES = {"beta_deg": "angle_deg"}
_KNOWN = re.compile(r"(start_)?p[1-9]\d*_kpa|angle_deg|load_kg")
_MEANT = re.compile(r"(start_)?p\d+(_.*)?|(angle|beta|load)(_.*)?")
_HIGHEST_KPA = 5e3
_LEAST_KPA = 20.0
_MOST_LOAD_KG = 100.0


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
    (first, header), *rows = csv_rows(path)
    names = [_ALIASES.get(name, name) for name in header]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{path}: line {first}: column {name!r} is there twice; keep one")
        if _MEANT.fullmatch(name) and not _KNOWN.fullmatch(name):
            raise InputError(
                f"{path}: line {first}: column {name!r} is not of this format, whose units are in"
                " the names: p1_kpa, p2_kpa, load_kg, angle_deg, start_p1_kpa, start_p2_kpa"
            )
    columns = {
        name: np.array([finite_cell(row[i], f"{path}: line {n}: {name}") for n, row in rows])
        for i, name in enumerate(names)
        if _KNOWN.fullmatch(name)
    }
    lines = [number for number, _ in rows]
    muscles = _muscles(path, names)
    for name in (*(f"p{i}_kpa" for i in muscles), "angle_deg"):
        if name not in columns:
            wanted = nearest(name, names)
            raise InputError(f"{path}: no column {name!r}, which a static table needs; {wanted}")
    _plausible(path, lines, columns)
    starts = [f"start_p{i}_kpa" for i in muscles]
    given = [name for name in starts if name in columns]
    if given and given != starts:
        raise InputError(f"{path}: {', '.join(given)} alone: give all of {', '.join(starts)}")
    notes = [f"{path.name}: column {n!r} is not used" for n in names if n not in columns]
    if "load_kg" not in columns:
        notes.append(f"{path.name}: no column load_kg, so no load")
    return StaticTable(
        name=path.stem,
        rows=tuple(f"line {number}" for number in lines),
        pressure=np.column_stack([columns[f"p{i}_kpa"] for i in muscles]) * PA_PER_KPA,
        load=columns.get("load_kg", np.zeros(len(rows))),
        angle=columns["angle_deg"] / DEG_PER_RAD,
        start=np.column_stack([columns[name] for name in starts]) * PA_PER_KPA if given else None,
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


def _muscles(path: Path, names: list[str]) -> range:
    numbers = [int(name[1:-4]) for name in names if re.fullmatch(r"p[1-9]\d*_kpa", name)]
    if not numbers:
        have = ", ".join(names)
        raise InputError(
            f"{path}: no column 'p1_kpa': a static table holds p1_kpa, p2_kpa, load_kg, angle_deg"
            f" (there are: {have})"
        )
    return range(1, max(numbers) + 1)


def _plausible(path: Path, lines: list[int], columns: dict[str, FloatArray]) -> None:
    def refuse(name: str, row: int, why: str) -> InputError:
        return InputError(f"{path}: line {lines[row]}: {name} = {columns[name][row]:g} {why}")

    pressures = [name for name in columns if name.endswith("_kpa")]
    for name in pressures:
        low, high = int(np.argmin(columns[name])), int(np.argmax(columns[name]))
        if columns[name][low] < 0.0:
            raise refuse(name, low, "is negative; pressures are gauge, and a muscle has no vacuum")
        if columns[name][high] > _HIGHEST_KPA:
            raise refuse(name, high, "is too much for a muscle; if it is Pa, divide it by 1000")
    top = max(float(columns[name].max()) for name in pressures)
    if 0.0 < top < _LEAST_KPA:
        raise InputError(
            f"{path}: no pressure is above {top:g}, too little for a muscle; if the columns hold"
            " bar, multiply them by 100"
        )
    for name, most, why in (
        ("angle_deg", 360.0, "is more than a turn; the column must hold deg"),
        ("load_kg", _MOST_LOAD_KG, "is no load for an arm; write kg, not g"),
    ):
        if name in columns:
            row = int(np.argmax(np.abs(columns[name])))
            if abs(columns[name][row]) > most:
                raise refuse(name, row, why)
            if name == "load_kg" and columns[name].min() < 0.0:
                raise refuse(name, int(np.argmin(columns[name])), "is negative")
