"""Read a user's measured table: a force map, a loop, loops of force, or angles at rest.

Which of the first three a file is shows in its columns; each name carries its unit:

- force map: pressure (``p_kpa``, ``p_gauge_pa``, ``p_bar``), ``contraction`` or
  ``contraction_percent`` or ``length_mm``, and ``force_n``;
- length-pressure loop: pressure and ``length_cm``, perhaps ``branch`` (up, down) and ``repeat``;
- force-displacement loops: ``time_s``, ``force_n``, ``displacement_mm``, perhaps ``loop``.

A static table holds the angles at which a rig came to rest, one row each: ``p1_kpa``, ``p2_kpa``
... (gauge, one per muscle, at rest), ``angle_deg`` (``beta_deg`` is the same), and, if they are
known, ``load_kg`` and the pressures before the step, ``start_p1_kpa``, ``start_p2_kpa`` ...
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError, nearest
from pamsim.core.limits import HEAVIEST_LOAD
from pamsim.core.units import FloatArray
from pamsim.recordings.columns import Columns
from pamsim.recordings.printed import distinct_steps
from pamsim.recordings.recording_checks import HIGHEST_KPA, LEAST_KPA
from pamsim.recordings.table_reader import read_columns

PRINTED = "mas20"
"""Name of the packaged static table: the 21 distinct rows of Matiskova 2021, Tables 1 and 2."""

_WORDS = ("branch", "repeat", "loop")
_MOST_CONTRACTION = 0.6
_STATIC_COLUMNS = ("p{}_kpa", "start_p{}_kpa", "angle_deg", "load_kg")


@dataclass(frozen=True, kw_only=True)
class ForceMap:
    """Static force over pressure and contraction.

    Attributes:
        pressure: gauge, shape (n,) [Pa].
        contraction: 1 - l/l0, shape (n,) [-].
        force: shape (n,) [N].
        nominal_length: l0 if the file or the user says it [m].
        notes: what was taken for granted, for the reader.
    """

    pressure: FloatArray
    contraction: FloatArray
    force: FloatArray
    nominal_length: float | None
    notes: tuple[str, ...] = ()

    def without_zeros(self) -> ForceMap:
        """The map without points of no force: there the muscle was slack or nothing was measured.

        Raises:
            InputError: if nothing is left.
        """
        keep = self.force != 0.0
        if not np.any(keep):
            raise InputError("the map has no force but zero; there is nothing to fit")
        dropped = int(np.sum(~keep))
        note = f"{dropped} points of zero force dropped: slack or not measured" if dropped else ""
        return replace(
            self,
            pressure=self.pressure[keep],
            contraction=self.contraction[keep],
            force=self.force[keep],
            notes=(*self.notes, *([note] if note else [])),
        )


@dataclass(frozen=True, kw_only=True)
class LengthLoop:
    """Length while the pressure goes up and down.

    Attributes:
        pressure: gauge, shape (n,) [Pa].
        length: shape (n,) [m].
        rising: whether each point belongs to the branch of rising pressure, shape (n,).
        notes: what was taken for granted, for the reader.
    """

    pressure: FloatArray
    length: FloatArray
    rising: NDArray[np.bool_]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class ForceLoops:
    """Force and displacement over time, one record per loop.

    Attributes:
        names: of the loops.
        time: per loop, shape (n_i,) [s].
        force: per loop, shape (n_i,) [N].
        displacement: per loop, shape (n_i,) [m].
        notes: what was taken for granted, for the reader.
    """

    names: tuple[str, ...]
    time: tuple[FloatArray, ...]
    force: tuple[FloatArray, ...]
    displacement: tuple[FloatArray, ...]
    notes: tuple[str, ...] = ()


MeasuredTable: TypeAlias = ForceMap | LengthLoop | ForceLoops


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


def read_measured(path: Path, nominal_length: float | None = None) -> MeasuredTable:
    """Read a force map, a length-pressure loop or force-displacement loops.

    Args:
        path: of the file.
        nominal_length: l0 for a force map that gives lengths only [m].

    Returns:
        The table, in SI.

    Raises:
        InputError: in one line: what `read_columns` refuses, missing quantities, a pressure
            or contraction that must be in another unit than the column's name says, lengths
            without a nominal length or at odds with the contraction beside them.
    """
    table = _Table(read_columns(path))
    if "displacement" in table.names or "time" in table.names:
        return _force_loops(table)
    pressure = table.si("pressure")
    _check_pressure(table, pressure)
    if "force" in table.names:
        contraction, nominal = _contraction(table, nominal_length)
        return ForceMap(
            pressure=pressure,
            contraction=contraction,
            force=table.si("force"),
            nominal_length=nominal,
            notes=table.notes,
        )
    if "length" in table.names:
        return _length_loop(table, pressure)
    raise table.columns.no_quantity("force" if "contraction" in table.names else "length")


class _Table:
    """A file's columns by quantity."""

    def __init__(self, columns: Columns) -> None:
        self.columns = columns
        self.quantities = columns.quantities()
        self.names = {quantity: q.column for quantity, q in self.quantities.items()}
        self.words = {
            name.lower(): [cell.lower() for cell in cells]
            for name, cells in columns.cells.items()
            if name.lower() in _WORDS
        }
        used = self.names.values()
        unused = (n for n in columns.cells if n not in used and n.lower() not in _WORDS)
        self.notes = tuple(f"column {name!r} is not used" for name in unused)

    def si(self, quantity: str) -> FloatArray:
        """Values of a quantity, shape (n,) [SI]; InputError if it has no column."""
        if quantity not in self.quantities:
            raise self.columns.no_quantity(quantity)
        measured = self.quantities[quantity]
        return self.columns.numbers(measured.column) * measured.scale

    def line(self, row: int) -> str:
        """File and line of a row, to begin an error with."""
        return f"{self.columns.path}: line {self.columns.lines[row]}"

    def cell(self, quantity: str, row: int) -> str:
        """File, line, column and value as written, to begin an error with."""
        return self.columns.where(self.names[quantity], row)


def _contraction(table: _Table, nominal: float | None) -> tuple[FloatArray, float | None]:
    """Contraction of a force map, and the nominal length [m] if that is known."""
    if "contraction" in table.names:
        contraction = table.si("contraction")
        bad = np.flatnonzero(np.abs(contraction) > _MOST_CONTRACTION)
        if bad.size:
            raise InputError(
                f"{table.cell('contraction', int(bad[0]))} is {contraction[bad[0]]:.0%}, which no"
                " muscle reaches; if it is percent, name the column contraction_percent"
            )
        if "length" in table.names:
            length = table.si("length")
            nominal = float(np.median(length / (1.0 - contraction))) if nominal is None else nominal
            odd = np.abs(1.0 - length / nominal - contraction)
            if np.max(odd) > 0.005:
                raise InputError(
                    f"{table.line(int(np.argmax(odd)))}: length and contraction disagree for a"
                    f" nominal length of {1e3 * nominal:.4g} mm; correct one of the columns or drop"
                    " it"
                )
        return contraction, nominal
    if "length" not in table.names:
        raise table.columns.no_quantity("contraction")
    if nominal is None:
        raise InputError(
            f"{table.columns.path}: {table.names['length']!r} needs the nominal length of the"
            " muscle; give `nominal_length`"
        )
    length = table.si("length")
    contraction = 1.0 - length / nominal
    far = np.flatnonzero(np.abs(contraction) > _MOST_CONTRACTION)
    if far.size:
        raise InputError(
            f"{table.line(int(far[0]))}: length {1e3 * length[far[0]]:.4g} mm of nominal"
            f" {1e3 * nominal:.4g} mm is beyond any muscle; check both units"
        )
    return contraction, nominal


def _length_loop(table: _Table, pressure: FloatArray) -> LengthLoop:
    branch, notes = table.words.get("branch"), table.notes
    if branch is None:
        rising = _rising(pressure)
        notes = (*notes, "no column 'branch': taken from whether the pressure rises or falls")
    else:
        for row, word in enumerate(branch):
            if word not in ("up", "down"):
                hint = nearest(word, ("up", "down"))
                raise InputError(f"{table.line(row)}: branch = {word!r}; {hint}")
        rising = np.array([word == "up" for word in branch])
    return LengthLoop(pressure=pressure, length=table.si("length"), rising=rising, notes=notes)


def _rising(pressure: FloatArray) -> NDArray[np.bool_]:
    """Whether the pressure rises towards each point; held pressure goes on as before."""
    move = np.sign(np.diff(pressure))
    moving = np.flatnonzero(move)
    if not moving.size:
        return np.ones(pressure.size, dtype=bool)
    # Where the pressure is held, its last move counts; before its first, the first to come.
    last = np.maximum.accumulate(np.where(move != 0.0, np.arange(move.size), moving[0]))
    steps = move[last] > 0.0
    return np.concatenate([steps[:1], steps])


def _force_loops(table: _Table) -> ForceLoops:
    label = table.words.get("loop", ["1"] * len(table.columns.lines))
    names = tuple(dict.fromkeys(label))
    rows = [np.flatnonzero(np.array(label) == name) for name in names]
    time, force, displacement = (
        tuple(values[r] for r in rows)
        for values in map(table.si, ("time", "force", "displacement"))
    )
    return ForceLoops(
        names=names, time=time, force=force, displacement=displacement, notes=table.notes
    )


def _check_pressure(table: _Table, pressure: FloatArray) -> None:
    """Refuse pressures that can only be in another unit than the column's name states."""
    name = table.names["pressure"]
    low, high = int(np.argmin(pressure)), int(np.argmax(pressure))
    if pressure[low] < -101325.0:
        raise InputError(f"{table.cell('pressure', low)} lies below vacuum; pressures are gauge")
    if pressure[high] < 1e3 * LEAST_KPA:
        unit = name.lower().rpartition("_")[2]
        meant = "kpa" if unit == "pa" else "bar"
        raise InputError(
            f"{table.line(0)} and below: no {name!r} is above"
            f" {table.columns.numbers(name)[high]:g} {unit}, too little for a muscle; if it is"
            f" {meant}, name the column 'p_{meant}'"
        )
    if pressure[high] > 1e3 * HIGHEST_KPA:
        raise InputError(
            f"{table.cell('pressure', high)} is {pressure[high] / 1e5:.4g} bar, too much for a"
            " muscle; check the unit in the column's name"
        )


def read_static_table(source: str | os.PathLike[str]) -> StaticTable:
    """Read a static table.

    Args:
        source: path of a CSV, or ``mas20`` for the packaged table.

    Raises:
        InputError: in one line with file, line and column: a missing or mistyped column, a cell
            that is no finite number, numbers that must be in another unit than their column says.
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
    path = Path(source)
    columns = read_columns(path).select(_STATIC_COLUMNS)
    numbers = [int(name[1:-4]) for name in columns.cells if re.fullmatch(r"p\d+_kpa", name)]
    pressures = [f"p{i}_kpa" for i in range(1, max(numbers, default=1) + 1)]
    for name in (*pressures, "angle_deg"):
        columns.require(name, ": a table of angles at rest needs p1_kpa, p2_kpa, angle_deg")
    _check_static(columns)
    starts = [f"start_{name}" for name in pressures]
    given = [name for name in starts if name in columns.cells]
    if given and given != starts:
        raise InputError(f"{path}: {', '.join(given)} alone: give all of {', '.join(starts)}")
    notes = [f"{path.name}: column {name!r} is not used" for name in columns.ignored]
    loaded = "load_kg" in columns.cells
    return StaticTable(
        name=path.stem,
        rows=tuple(f"line {number}" for number in columns.lines),
        pressure=np.column_stack([columns.si(name) for name in pressures]),
        load=columns.si("load_kg") if loaded else np.zeros(len(columns.lines)),
        angle=columns.si("angle_deg"),
        start=np.column_stack([columns.si(name) for name in starts]) if given else None,
        notes=(*notes, *([] if loaded else [f"{path.name}: no column load_kg, so no load"])),
    )


def _check_static(columns: Columns) -> None:
    kpa = [name for name in columns.values if name.endswith("_kpa")]
    vacuum = "is negative; pressures are gauge, and a muscle has no vacuum"
    pascal = "is too much for a muscle; if it is Pa, divide it by 1000"
    counts = "is more than a turn; the column must hold deg"
    for name, low, high, below, above in (
        *((name, 0.0, HIGHEST_KPA, vacuum, pascal) for name in kpa),
        ("angle_deg", -360.0, 360.0, counts, counts),
        ("load_kg", 0.0, HEAVIEST_LOAD, "is negative", "is no load for an arm; write kg, not g"),
    ):
        if name in columns.values:
            columns.require_range(name, (low, high), below, above)
    top = max(float(columns.values[name].max()) for name in kpa)
    if 0.0 < top < LEAST_KPA:
        raise InputError(
            f"{columns.path}: no pressure is above {top:g}, too little for a muscle; if the columns"
            " hold bar, multiply them by 100"
        )
