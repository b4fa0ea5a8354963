"""Read a user's measured CSV: a force map, a length-pressure loop, or force-displacement loops.

Which of the three a file is shows in its columns; each name carries its unit:

- force map: pressure (``p_kpa``, ``p_gauge_pa``, ``p_bar``), ``contraction`` or
  ``contraction_percent`` or ``length_mm``, and ``force_n``;
- length-pressure loop: pressure and ``length_cm``, perhaps ``branch`` (up, down) and ``repeat``;
- force-displacement loops: ``time_s``, ``force_n``, ``displacement_mm``, perhaps ``loop``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError, nearest
from pamsim.recordings.columns import Columns, read_columns

FloatArray = NDArray[np.float64]

_WORDS = ("branch", "repeat", "loop")
_MOST_CONTRACTION = 0.6


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


def read_measured(path: Path, nominal_length: float | None = None) -> MeasuredTable:
    """Read a measured CSV.

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
    notes = [f"column {name!r} is not used" for name in table.ignored]
    if "displacement" in table.names or "time" in table.names:
        return _force_loops(table, notes)
    pressure = table.si("pressure")
    _plausible_pressure(table)
    if "force" in table.names:
        return _force_map(table, pressure, nominal_length, notes)
    if "length" in table.names:
        return _length_loop(table, pressure, notes)
    raise table.columns.no_quantity("force" if "contraction" in table.names else "length")


class _Table:
    """A file's columns by quantity."""

    def __init__(self, columns: Columns) -> None:
        self.columns = columns
        self.lines = columns.lines
        self.quantities = columns.quantities()
        self.names = {quantity: q.column for quantity, q in self.quantities.items()}
        self.words = {
            name.lower(): [cell.lower() for cell in cells]
            for name, cells in columns.cells.items()
            if name.lower() in _WORDS
        }
        used = {*self.names.values()}
        self.ignored = [
            name for name in columns.cells if name not in used and name.lower() not in _WORDS
        ]

    def si(self, quantity: str) -> FloatArray:
        """Values of a quantity, shape (n,) [SI]; InputError if it has no column."""
        if quantity not in self.quantities:
            raise self.columns.no_quantity(quantity)
        measured = self.quantities[quantity]
        return self.columns.numbers(measured.column) * measured.scale

    def line(self, row: int) -> str:
        """File and line of a row, to begin an error with."""
        return f"{self.columns.path}: line {self.lines[row]}"

    def cell(self, quantity: str, row: int) -> str:
        """File, line, column and value as written, to begin an error with."""
        name = self.names[quantity]
        return f"{self.line(row)}: {name} = {self.columns.numbers(name)[row]:g}"


def _force_map(
    table: _Table, pressure: FloatArray, nominal: float | None, notes: list[str]
) -> ForceMap:
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
    elif "length" not in table.names:
        raise table.columns.no_quantity("contraction")
    elif nominal is None:
        raise InputError(
            f"{table.columns.path}: {table.names['length']!r} needs the nominal length of the"
            " muscle; give `nominal_length`"
        )
    else:
        length = table.si("length")
        contraction = 1.0 - length / nominal
        far = np.flatnonzero(np.abs(contraction) > _MOST_CONTRACTION)
        if far.size:
            raise InputError(
                f"{table.line(int(far[0]))}: length {1e3 * length[far[0]]:.4g} mm of nominal"
                f" {1e3 * nominal:.4g} mm is beyond any muscle; check both units"
            )
    return ForceMap(
        pressure=pressure,
        contraction=contraction,
        force=table.si("force"),
        nominal_length=nominal,
        notes=tuple(notes),
    )


def _length_loop(table: _Table, pressure: FloatArray, notes: list[str]) -> LengthLoop:
    if "branch" in table.words:
        for row, word in enumerate(table.words["branch"]):
            if word not in ("up", "down"):
                hint = nearest(word, ("up", "down"))
                raise InputError(f"{table.line(row)}: branch = {word!r}; {hint}")
        rising = np.array([word == "up" for word in table.words["branch"]])
    else:
        rising = _rising(pressure)
        notes.append("no column 'branch': taken from whether the pressure rises or falls")
    return LengthLoop(
        pressure=pressure, length=table.si("length"), rising=rising, notes=tuple(notes)
    )


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


def _force_loops(table: _Table, notes: list[str]) -> ForceLoops:
    label = table.words.get("loop", ["1"] * len(table.lines))
    names = tuple(dict.fromkeys(label))
    rows = [np.flatnonzero(np.array(label) == name) for name in names]
    time, force, displacement = (
        tuple(values[r] for r in rows)
        for values in map(table.si, ("time", "force", "displacement"))
    )
    return ForceLoops(
        names=names, time=time, force=force, displacement=displacement, notes=tuple(notes)
    )


def _plausible_pressure(table: _Table) -> None:
    """Refuse pressures that can only be in another unit than the column's name states.

    Fluidic muscles work at some bar; a whole table below 20 kPa or above 50 bar is implausible.
    """
    pressure, name = table.si("pressure"), table.names["pressure"]
    written = table.columns.numbers(name)
    low, high = int(np.argmin(pressure)), int(np.argmax(pressure))
    if pressure[low] < -101325.0:
        raise InputError(f"{table.cell('pressure', low)} lies below vacuum; pressures are gauge")
    if pressure[high] < 2e4:
        unit = name.lower().rpartition("_")[2]
        meant = "kpa" if unit == "pa" else "bar"
        raise InputError(
            f"{table.line(0)} and below: no {name!r} is above {np.max(written):g} {unit}, too"
            f" little for a muscle; if it is {meant}, name the column 'p_{meant}'"
        )
    if pressure[high] > 5e6:
        raise InputError(
            f"{table.cell('pressure', high)} is {pressure[high] / 1e5:.4g} bar, too much for a"
            " muscle; check the unit in the column's name"
        )
