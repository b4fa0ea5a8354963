"""Columns whose names carry quantity and unit, such as ``time_s`` or ``p1_kpa``.

All formats of measurements are columns: of trials and angles at rest by fixed names
(`Columns.select`), of force maps and loops in any unit (`pamsim.recordings.measured_table`), of a
lab's own log by what is said of them (`pamsim.recordings.log_columns`).
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError, nearest
from pamsim.core.units import FloatArray
from pamsim.recordings.signals import KINDS

# Fixed names, {} being the number of a muscle -> other spellings of them, which are refused.
_SPELLINGS = {
    "time_s": r"time(_.*)?|t|t_m?s",
    "angle_deg": r"angle(_.*)?|beta(_.*)?",
    "load_kg": r"load(_.*)?",
    "p{}_set_kpa": r"p([1-9]\d*)_set(_.*)?",
    "p{}_kpa": r"p([1-9]\d*)(_.*)?",
    "start_p{}_kpa": r"start_p([1-9]\d*)(_.*)?",
    "force{}_n": r"force([1-9]\d*)(_.*)?|f([1-9]\d*)_k?n",
    "u{}": r"u([1-9]\d*)_.*",
}
_SAME = {"beta_deg": "angle_deg"}
_INSTANT = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d")
_CLOSE = 0.8  # similarity at which another name is taken for a mistyped one
_SI = {kind.suffix: 1.0 / kind.scale for kind in KINDS.values()}


@dataclass(frozen=True)
class Cells:
    """The cells of one column: (n,) numbers, None if a cell is none, and row -> text as written."""

    numbers: FloatArray | None
    count: int
    written: Callable[[int], str]

    def __getitem__(self, row: int) -> str:
        return self.written(row)

    def __iter__(self) -> Iterator[str]:
        return map(self.written, range(self.count))


def cells_of(columns: Mapping[str, FloatArray]) -> dict[str, Cells]:
    """The cells of columns (n,) in any unit, which were never written as text."""

    def cells(values: FloatArray) -> Cells:
        return Cells(values, len(values), lambda row: repr(float(values[row])))

    return {name: cells(values) for name, values in columns.items()}


@dataclass(frozen=True, kw_only=True)
class Columns:
    """The columns of a file."""

    path: Path  # of the file, for errors
    header: int  # line number of the header; 0 of a file without one
    lines: Sequence[int]  # line number of each row
    cells: Mapping[str, Cells]  # name -> cell of each row, in the order of the file
    ignored: tuple[str, ...] = ()  # names of columns that the format does not know
    # name -> unit, where the file has a line of them
    units: Mapping[str, str] = field(default_factory=dict[str, str])
    notes: tuple[str, ...] = ()  # what a reader should know, one sentence each
    turned: frozenset[str] = frozenset()  # names of those whose sign is not the log's

    @cached_property
    def values(self) -> Mapping[str, FloatArray]:
        """Name -> `numbers`."""
        return {name: self.numbers(name) for name in self.cells}

    def numbers(self, name: str) -> FloatArray:
        """The numbers of one column, shape (n,), in the unit of its name; of dates, `instants`.

        Raises:
            InputError: for a cell that is empty, text, NaN or infinite.
        """
        cells = self.cells[name]
        if cells.numbers is None and (instants := self.instants(name)) is not None:
            return instants
        if cells.numbers is None or not np.isfinite(cells.numbers).all():
            for line, cell in zip(self.lines, cells, strict=True):
                _check_finite(cell, f"{self.path}: line {line}: {name}")
        return np.array(list(cells), dtype=float) if cells.numbers is None else cells.numbers

    def instants(self, name: str) -> FloatArray | None:
        """Times (n,) after the first row [s] of a column of dates with times of day, else None.

        As ISO 8601 writes them, ``2026-11-02 10:15:00.12``.
        """
        cells = self.cells[name]
        if not (cells.count and _INSTANT.match(cells[0])):
            return None
        try:
            read = [datetime.fromisoformat(cell) for cell in cells]
            return np.array([(one - read[0]).total_seconds() for one in read])
        except (ValueError, TypeError):  # a cell that is none, or has no time zone as others have
            return None

    def si(self, name: str) -> FloatArray:
        """The numbers of one column, shape (n,) [SI]; ``_kpa``, ``_deg``, ``_mm`` are converted."""
        return self.values[name] * _SI.get(name.rpartition("_")[2].lower(), 1.0)

    def place(self, name: str) -> str:
        """File, line of the header and name of a column, to begin an error with."""
        return f"{self.path}: line {self.header}: column {name!r}"

    def select(self, names: Sequence[str]) -> Columns:
        """The columns of a format with fixed names; the others become ``ignored``.

        In a name such as ``p{}_kpa``, ``{}`` is the number of a muscle, from 1.

        Raises:
            InputError: for a known quantity in another unit, and for a name so close to a known one
                that it must be meant.
        """
        # Of more muscles than a table has columns, a reader would have no end.
        parts = (r"[1-9]\d{0,3}".join(map(re.escape, name.split("{}"))) for name in names)
        fixed = re.compile("|".join(parts))
        known = {
            name: same for name in self.cells if fixed.fullmatch(same := _SAME.get(name, name))
        }
        ignored = [name for name in self.cells if name not in known]
        for name in ignored:
            _refuse_near(name, names, self.place(name))
        self.refuse_twice(list(known.values()))
        cells = {same: self.cells[name] for name, same in known.items()}
        return replace(self, cells=cells, ignored=(*self.ignored, *ignored), units={})

    def require(self, name: str, why: str = "", missing: str = "no column") -> None:
        """Refuse a file without a column, with why it must be there and the columns that are."""
        if name not in self.cells:
            have = ", ".join((*self.cells, *self.ignored))
            raise InputError(f"{self.path}: {missing} {name!r}{why} (there are: {have})")

    def require_range(
        self, name: str, low: float, high: float, below: str, above: str = ""
    ) -> None:
        """Refuse numbers of a column that are too low or too high, with what is wrong with each."""
        values = self.values[name]
        for outside, worst, why in (
            (values > high, values.max(), above or below),
            (values < low, values.min(), below),
        ):
            self.refuse(
                outside & (values == worst), lambda _, v=worst, w=why: f"{name} = {v:g} {w}"
            )

    def refuse(self, rows: NDArray[np.bool_], why: Callable[[int], str]) -> None:
        """Refuse the first of the rows marked, with what is wrong with it."""
        if rows.any():
            row = int(np.argmax(rows))
            raise InputError(f"{self.path}: line {self.lines[row]}: {why(row)}")

    def refuse_twice(self, names: Sequence[str]) -> None:
        """Refuse names of columns of which one is there twice."""
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"{self.place(name)} is there twice; keep one")


def _check_finite(cell: str, where: str) -> None:
    if not cell:
        raise InputError(f"{where} is empty; fill the gap or drop the row")
    try:
        finite = math.isfinite(float(cell))
    except ValueError:
        raise InputError(f"{where} = {cell!r} is not a number; write one such as 12.5") from None
    if not finite:
        raise InputError(f"{where} = {cell} is not finite; drop the row")


def _refuse_near(name: str, names: Sequence[str], where: str) -> None:
    for fixed in names:
        if match := re.fullmatch(_SPELLINGS.get(fixed, ""), name.lower()):
            muscle = next((group for group in match.groups() if group and group.isdigit()), "1")
            if (meant := fixed.format(muscle)) == name:
                raise InputError(f"{where} is of a muscle of too high a number; count them from 1")
            raise InputError(
                f"{where} is not known; convert it if it has another unit, and name it {meant!r}"
            )
    known = {fixed.format(muscle) for fixed in names for muscle in ("1", "2")}
    if difflib.get_close_matches(name.lower(), known, n=1, cutoff=_CLOSE):
        raise InputError(f"{where} is not known; {nearest(name.lower(), known)}")
