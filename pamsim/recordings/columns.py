"""Read a table whose column names carry quantity and unit, such as ``time_s`` or ``p1_kpa``.

The first line names the columns; blank lines and lines that begin with ``#`` are left out. All
formats of measurements are read here: trials of a recording and angles at rest by fixed names
(`Columns.select`), force maps and loops by quantity with any unit (`Columns.quantities`), a log
for ``pamsim identify`` as it is (`Columns.values`), a lab's own log by what its recording says of
its columns (`pamsim.recordings.log_columns`).
"""

from __future__ import annotations

import csv
import difflib
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pamsim.core.bounded_read import read_bounded
from pamsim.core.errors import InputError, nearest
from pamsim.core.limits import (
    LINE_CHARACTERS,
    NAME_CHARACTERS,
    TABLE_BYTES,
    TABLE_CELLS,
    TABLE_COLUMNS,
)
from pamsim.core.units import DEG_PER_RAD, MM_PER_M, PA_PER_KPA, to_si
from pamsim.recordings.array_files import ARRAY_FILES, read_arrays

FloatArray = NDArray[np.float64]

_SMALLER = "cut it into several files, or leave out columns"
_LARGER = f"save it as Parquet or .npz, or {_SMALLER}"
_MARKS = ";\t,|"
_DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d*([eE][-+]?\d+)?")

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
_NONE = ("", "-", "--")  # in a line of units
_CLOSE = 0.8  # similarity at which another name is taken for a mistyped one
_SI = {"kpa": PA_PER_KPA, "deg": 1.0 / DEG_PER_RAD, "mm": 1.0 / MM_PER_M}

# Quantity -> what a column name may begin with, the SI unit, an example.
_QUANTITIES: Mapping[str, tuple[tuple[str, ...], str, str]] = {
    "pressure": (("p", "p_gauge", "pressure", "pressure_gauge"), "Pa", "p_kpa"),
    "contraction": (("contraction", "kappa"), "1", "contraction_percent"),
    "length": (("length",), "m", "length_mm"),
    "force": (("force",), "N", "force_n"),
    "displacement": (("displacement",), "m", "displacement_mm"),
    "time": (("time",), "s", "time_s"),
}
_PURE = {"": "1", "ratio": "1", "percent": "percent"}
# Files write units in lower case, the unit library does not.
_SPELLED = {"kpa": "kPa", "pa": "Pa", "mpa": "MPa", "hpa": "hPa", "n": "N", "kn": "kN"}


@dataclass(frozen=True)
class Quantity:
    """A column as a quantity: its name in the file and its factor to SI."""

    column: str
    scale: float


@dataclass(frozen=True, kw_only=True)
class Columns:
    """The columns of a CSV file.

    Attributes:
        path: of the file, for errors.
        header: line number of the header; 0 of a file without one.
        lines: line number of each row.
        cells: name -> text of each row, stripped, in the order of the file.
        ignored: names of columns that the format does not know.
        units: name -> unit, where the file has a line of them.
    """

    path: Path
    header: int
    lines: list[int]
    cells: Mapping[str, list[str]]
    ignored: tuple[str, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)

    @cached_property
    def values(self) -> Mapping[str, FloatArray]:
        """Name -> (n,) numbers, in the unit of the name.

        Raises:
            InputError: for a cell that is empty, text, NaN or infinite.
        """
        return {name: self.numbers(name) for name in self.cells}

    def numbers(self, name: str) -> FloatArray:
        """The numbers of one column, shape (n,), in the unit of its name.

        Raises:
            InputError: as `values`.
        """
        return np.array(
            [
                _finite(cell, f"{self.path}: line {line}: {name}")
                for line, cell in zip(self.lines, self.cells[name], strict=True)
            ]
        )

    def si(self, name: str) -> FloatArray:
        """The numbers of one column, shape (n,) [SI]; ``_kpa``, ``_deg``, ``_mm`` are converted."""
        return self.values[name] * _SI.get(name.rpartition("_")[2].lower(), 1.0)

    def where(self, name: str, row: int) -> str:
        """File, line, column and value of a cell, to begin an error with."""
        return f"{self.path}: line {self.lines[row]}: {name} = {self.values[name][row]:g}"

    def select(self, names: Sequence[str]) -> Columns:
        """The columns of a format with fixed names; the others become ``ignored``.

        Args:
            names: such as ``p{}_kpa``; ``{}`` is the number of a muscle, from 1.

        Raises:
            InputError: for a known quantity in another unit, and for a name so close to a known one
                that it must be meant.
        """
        parts = (r"[1-9]\d*".join(map(re.escape, name.split("{}"))) for name in names)
        fixed = re.compile("|".join(parts))
        known = {
            name: same for name in self.cells if fixed.fullmatch(same := _SAME.get(name, name))
        }
        ignored = [name for name in self.cells if name not in known]
        for name in ignored:
            _refuse_near(name, names, self._column(name))
        self._refuse_twice(list(known.values()))
        return Columns(
            path=self.path,
            header=self.header,
            lines=self.lines,
            cells={same: self.cells[name] for name, same in known.items()},
            ignored=(*self.ignored, *ignored),
        )

    def require(self, name: str, why: str = "") -> None:
        """Check that a column is there.

        Args:
            name: of the column.
            why: it must be, for the error.

        Raises:
            InputError: if it is not, with the names that are.
        """
        if name not in self.cells:
            have = ", ".join((*self.cells, *self.ignored))
            raise InputError(f"{self.path}: no column {name!r}{why} (there are: {have})")

    def quantities(self) -> Mapping[str, Quantity]:
        """The columns whose names begin like a quantity: pressure, contraction, length and so on.

        Returns:
            Quantity -> column and scale; the unit may be any that measures the quantity.

        Raises:
            InputError: for a missing, unknown or wrong unit, and two columns of one quantity.
        """
        quantities: dict[str, Quantity] = {}
        for name in self.cells:
            meaning = _quantity(name, self._column(name))
            if meaning is None:
                continue
            quantity, unit = meaning
            if quantity in quantities:
                there = quantities[quantity].column
                raise InputError(f"{self._column(name)}: there is {there!r} already; keep one")
            where = f"{self.path}: column {name!r}"
            quantities[quantity] = Quantity(
                name, to_si(1.0, unit, _QUANTITIES[quantity][1], where=where)
            )
        return quantities

    def no_quantity(self, quantity: str) -> InputError:
        """The error for a quantity without a column."""
        return InputError(
            f"{self.path}: no column for {quantity}; name one such as {_QUANTITIES[quantity][2]!r}"
            f" (there are: {', '.join(self.cells)})"
        )

    def _column(self, name: str) -> str:
        return f"{self.path}: line {self.header}: column {name!r}"

    def _refuse_twice(self, names: Sequence[str]) -> None:
        seen: set[str] = set()
        for name in names:
            if name in seen:
                raise InputError(f"{self._column(name)} is there twice; keep one")
            seen.add(name)


def read_columns(path: Path, *, numbers_only: bool = False) -> Columns:
    """Read a table with a header.

    Args:
        path: of a text file, its cells separated by commas, semicolons, tabs, bars or spaces, with
            decimal points, or with decimal commas where no comma separates cells; a line of units
            may follow the header, and lines of another number of cells come before it. Or of an
            ``.npz`` or ``.mat`` file with one array per column, or of a ``.parquet`` file.
        numbers_only: whether a text file may be without header; its columns are ``column_1``, ...

    Returns:
        Its columns as text.

    Raises:
        InputError: in one line: unreadable file, no header, no row below it, a row of another
            length than the header, arrays of different lengths, a column twice.
    """
    if path.suffix.lower() in ARRAY_FILES:
        return _of_arrays(path)
    text = _text(path)
    _check_size(path, max(map(text.count, _MARKS)) + text.count("\n"))
    rows = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    for number, line in rows:
        if len(line) > LINE_CHARACTERS:
            raise InputError(
                f"{path}: line {number} has {len(line):,} characters; a table's have"
                f" {LINE_CHARACTERS:,} at most"
            )
    if not rows:
        raise InputError(f"{path}: no header; name the columns in the first line, such as time_s")
    if len(rows) == 1:
        raise InputError(f"{path}: no rows below the header in line {rows[0][0]}")
    start, separator = _header(rows)
    first, header = rows[start][0], _cells(rows[start][1], separator)
    _check_columns(path, header)
    if numbers_only and all(map(_is_number, header)):
        start, first = start - 1, 0
        header = [f"column_{i}" for i in range(1, len(header) + 1)]
    cells = [(number, _cells(line, separator)) for number, line in rows[start + 1 :]]
    for number, row in cells:
        if len(row) != len(header):
            raise InputError(
                f"{path}: line {number} has {len(row)} cells, the header {len(header)}; write"
                " points in numbers, or separate cells by semicolons"
            )
    units: list[str] = []
    if len(cells) > 1 and not any(map(_is_number, cells[0][1])) and _is_number(cells[1][1][0]):
        units = [cell.strip("[]() ") for cell in cells.pop(0)[1]]
    if separator != ",":
        cells = [(number, [_pointed(cell) for cell in row]) for number, row in cells]
    columns = Columns(
        path=path,
        header=first,
        lines=[number for number, _ in cells],
        cells={name: [row[i] for _, row in cells] for i, name in enumerate(header)},
        units={
            name: unit for name, unit in zip(header, units, strict=bool(units)) if unit not in _NONE
        },
    )
    columns._refuse_twice(header)
    return columns


def _check_size(path: Path, cells: int) -> None:
    if cells > TABLE_CELLS:
        raise InputError(
            f"{path} has about {cells:,} cells; a table has {TABLE_CELLS:,} at most: {_SMALLER}"
        )


def _check_columns(path: Path, names: Sequence[str]) -> None:
    count, longest = len(names), max(map(len, names))
    if count > TABLE_COLUMNS:
        raise InputError(f"{path} has {count:,} columns; a table has {TABLE_COLUMNS:,} at most")
    if longest > NAME_CHARACTERS:
        raise InputError(f"{path}: the name of a column has {longest:,} characters; shorten it")


def _text(path: Path) -> str:
    try:
        written = read_bounded(path, TABLE_BYTES, instead=_LARGER)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from None
    # UTF-8, or what spreadsheets write beside it; almost any bytes can be read as cp1252.
    utf16 = written.startswith((b"\xff\xfe", b"\xfe\xff"))
    for encoding in ("utf-16",) if utf16 else ("utf-8-sig", "cp1252"):
        try:
            text = written.decode(encoding)
        except UnicodeDecodeError:
            continue
        if encoding != "cp1252" or "".join(text.split()).isprintable():
            return text
    raise InputError(f"{path} is not a text file in UTF-8; save it as a CSV in UTF-8")


def _header(rows: Sequence[tuple[int, str]]) -> tuple[int, str | None]:
    """Place of the header among the lines of a file, and the mark between its cells.

    The header is the first line with as many cells as a row, if it comes before all rows: what
    loggers write above is no table.
    """
    among = rows[len(rows) // 2][1]
    for start, (_, line) in enumerate(rows[: len(rows) // 2]):
        separator = next((mark for mark in _MARKS if mark in line), None)
        cells = _cells(line, separator)
        if all(map(_is_number, cells)):
            break
        if len(cells) == len(_cells(among, separator)) > 1:
            return start, separator
    return 0, next((mark for mark in _MARKS if mark in rows[0][1]), None)


def _is_number(cell: str) -> bool:
    try:
        float(_pointed(cell))
    except ValueError:
        return False
    return True


def _cells(line: str, separator: str | None) -> list[str]:
    if separator is None:
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]


def _pointed(cell: str) -> str:
    """A number with a decimal comma, with a point."""
    return cell.replace(",", ".") if _DECIMAL_COMMA.fullmatch(cell) else cell


def _of_arrays(path: Path) -> Columns:
    """The arrays of a file of another format; what is no list of numbers is left out."""
    found = read_arrays(path)
    lists = {
        name: array.ravel()
        for name, array in found.items()
        if array.dtype.kind in "iuf" and array.ndim and array.size == max(array.shape) > 1
    }
    if not lists:
        raise InputError(f"{path}: no array of numbers; give one per column, all of one length")
    _check_columns(path, list(lists))
    _check_size(path, sum(map(len, lists.values())))
    longest = max(lists.values(), key=len)
    for name, array in lists.items():
        if len(array) != len(longest):
            raise InputError(
                f"{path}: {name} has {len(array)} numbers, another array {len(longest)}; a table's"
                " columns are of one length"
            )
    return Columns(
        path=path,
        header=1,
        lines=list(range(1, len(longest) + 1)),
        cells={name: [repr(number) for number in a.tolist()] for name, a in lists.items()},
    )


def _finite(cell: str, where: str) -> float:
    if not cell:
        raise InputError(f"{where} is empty; fill the gap or drop the row")
    try:
        value = float(cell)
    except ValueError:
        raise InputError(f"{where} = {cell!r} is not a number; write one such as 12.5") from None
    if not math.isfinite(value):
        raise InputError(f"{where} = {cell} is not finite; drop the row")
    return value


def _refuse_near(name: str, names: Sequence[str], where: str) -> None:
    lower = name.lower()
    for fixed in names:
        match = re.fullmatch(_SPELLINGS.get(fixed, ""), lower)
        if match:
            muscle = next((group for group in match.groups() if group and group.isdigit()), "1")
            raise InputError(
                f"{where} is not of this format, whose unit is in the name: convert it if need be"
                f" and name it {fixed.format(muscle)!r}"
            )
    known = {fixed.format(muscle) for fixed in names for muscle in ("1", "2")}
    if difflib.get_close_matches(lower, known, n=1, cutoff=_CLOSE):
        raise InputError(f"{where} is not known; {nearest(lower, known)}")


def _quantity(name: str, where: str) -> tuple[str, str] | None:
    """Quantity and unit of a column name; None if the name begins like no quantity."""
    lower = name.lower()
    # The longest beginning first: p_gauge_pa is a pressure in Pa and not in gauge_pa.
    known = [(stem, q) for q, (stems, _, _) in _QUANTITIES.items() for stem in stems]
    for stem, quantity in sorted(known, key=lambda pair: -len(pair[0])):
        if lower != stem and not lower.startswith(stem + "_"):
            continue
        unit = lower[len(stem) + 1 :]
        if quantity == "contraction":
            if unit not in _PURE:
                raise InputError(f"{where}: unit {unit!r} is not known; {nearest(unit, _PURE)}")
            return quantity, _PURE[unit]
        if not unit:
            example = _QUANTITIES[quantity][2]
            raise InputError(f"{where} has no unit; write it in the name: {example!r}")
        return quantity, _SPELLED.get(unit, unit)
    return None
