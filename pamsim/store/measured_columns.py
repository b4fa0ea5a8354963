"""Columns of a measured CSV: names that carry their unit, cells that must be finite numbers."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError, nearest
from pamsim.core.units import to_si

FloatArray = NDArray[np.float64]

# quantity -> stems a column name may begin with, the unit wanted, an example for errors
_STEMS: Mapping[str, tuple[tuple[str, ...], str, str]] = {
    "pressure": (("p", "p_gauge", "pressure", "pressure_gauge"), "Pa", "p_kpa"),
    "contraction": (("contraction", "kappa"), "1", "contraction_percent"),
    "length": (("length",), "m", "length_mm"),
    "force": (("force",), "N", "force_n"),
    "displacement": (("displacement",), "m", "displacement_mm"),
    "time": (("time",), "s", "time_s"),
}
# Pure numbers need no unit; files write units in one case, the unit library in another.
_PURE = {"": "1", "ratio": "1", "percent": "percent"}
_SPELLING = {"kpa": "kPa", "pa": "Pa", "mpa": "MPa", "hpa": "hPa", "n": "N", "kn": "kN"}
_WORDS = ("branch", "repeat", "loop")


@dataclass(frozen=True, kw_only=True)
class Columns:
    """A table as read.

    Attributes:
        path: of the file, for errors.
        values: quantity -> values, shape (n,) [SI].
        written: quantity -> values as written, shape (n,), for judging plausibility.
        names: quantity -> column name.
        words: ``branch``, ``repeat`` and ``loop`` columns, lower case.
        lines: line number of each row.
        ignored: names of columns that mean nothing here.
    """

    path: Path
    values: Mapping[str, FloatArray]
    written: Mapping[str, FloatArray]
    names: Mapping[str, str]
    words: Mapping[str, list[str]]
    lines: list[int]
    ignored: tuple[str, ...]


def read_columns(path: Path) -> Columns:
    """Read a CSV with a header; lines that begin with ``#`` are comments.

    Args:
        path: of the file.

    Returns:
        Its columns.

    Raises:
        InputError: in one line with the line number: unreadable file, no header, no rows, two
            columns of one quantity, an unknown unit, a row of another length, a cell that is
            empty, text, NaN or infinite.
    """
    lines = _lines(path)
    if not lines:
        raise InputError(f"{path}: no header; the first line names the columns, such as p_kpa")
    number, header = lines[0]
    if len(header) == 1 and ";" in header[0]:
        raise InputError(
            f"{path}: line {number}: cells are separated by semicolons; write commas between"
            " cells and points in numbers"
        )
    if len(lines) == 1:
        raise InputError(f"{path}: no rows below the header in line {number}")
    names = [name.strip() for name in header]
    found: dict[str, tuple[int, str]] = {}
    words: dict[str, list[str]] = {}
    ignored: list[str] = []
    for index, name in enumerate(names):
        where = f"{path}: line {number}: column {name!r}"
        if name.lower() in _WORDS:
            words[name.lower()] = []
            continue
        quantity, unit = _meaning(name, where)
        if quantity is None:
            ignored.append(name)
        elif quantity in found:
            raise InputError(f"{where}: there is {names[found[quantity][0]]!r} already; keep one")
        else:
            found[quantity] = (index, unit)
    # Converted once per column: an unknown unit is told before any cell is looked at.
    factors = {
        quantity: to_si(1.0, unit, _STEMS[quantity][1], where=f"{path}: column {names[index]!r}")
        for quantity, (index, unit) in found.items()
    }
    written: dict[str, list[float]] = {quantity: [] for quantity in found}
    for number, row in lines[1:]:
        if len(row) != len(names):
            raise InputError(
                f"{path}: line {number} has {len(row)} cells, the header {len(names)};"
                " write points, not commas, in numbers"
            )
        for quantity, (index, _) in found.items():
            cell = f"{path}: line {number}: {names[index]}"
            written[quantity].append(_number(row[index].strip(), cell))
        for word in words:
            words[word].append(row[[n.lower() for n in names].index(word)].strip().lower())
    arrays = {quantity: np.array(column) for quantity, column in written.items()}
    return Columns(
        path=path,
        values={quantity: column * factors[quantity] for quantity, column in arrays.items()},
        written=arrays,
        names={quantity: names[index] for quantity, (index, _) in found.items()},
        words=words,
        lines=[number for number, _ in lines[1:]],
        ignored=tuple(ignored),
    )


def missing(columns: Columns, quantity: str) -> InputError:
    """The error for a quantity without a column."""
    have = [*columns.names.values(), *columns.words, *columns.ignored]
    example = _STEMS[quantity][2]
    return InputError(
        f"{columns.path}: no column for {quantity}; name one such as {example!r}"
        f" (there are: {', '.join(have)})"
    )


def plausible_pressure(columns: Columns) -> None:
    """Refuse pressures that can only be in another unit than the name says.

    Fluidic muscles work at some bar: a whole table below 20 kPa or above 50 bar was not meant.

    Raises:
        InputError: naming the unit that was probably meant.
    """
    pressure, name = columns.values["pressure"], columns.names["pressure"]
    largest = float(np.max(pressure))
    below = int(np.argmin(pressure))
    if pressure[below] < -101325.0:
        raise InputError(
            f"{columns.path}: line {columns.lines[below]}: {name} = "
            f"{columns.written['pressure'][below]:g} lies below vacuum; pressures are gauge"
        )
    if largest < 2e4:
        unit = name.lower().rpartition("_")[2]
        meant = "kpa" if unit == "pa" else "bar"
        raise InputError(
            f"{columns.path}: line {columns.lines[0]} and below: no {name!r} is above"
            f" {np.max(columns.written['pressure']):g} {unit}, too little for a muscle; if it is"
            f" {meant}, name the column 'p_{meant}'"
        )
    if largest > 5e6:
        worst = int(np.argmax(pressure))
        raise InputError(
            f"{columns.path}: line {columns.lines[worst]}: {name} ="
            f" {columns.written['pressure'][worst]:g} is {largest / 1e5:.4g} bar, too much for a"
            " muscle; check the unit in the column's name"
        )


def _lines(path: Path) -> list[tuple[int, list[str]]]:
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise InputError(f"{path} is not a text file; give a CSV in UTF-8") from None
    return [
        (number, next(csv.reader([line])))
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]


def _meaning(name: str, where: str) -> tuple[str | None, str]:
    """Quantity and unit of a column name; no quantity if the name begins like none."""
    lower = name.lower()
    # The longest stem first, so that p_gauge_pa is a pressure in Pa and not in gauge_pa.
    stems = [(stem, q) for q, (known, _, _) in _STEMS.items() for stem in known]
    for stem, quantity in sorted(stems, key=lambda pair: -len(pair[0])):
        if lower != stem and not lower.startswith(stem + "_"):
            continue
        unit = lower[len(stem) + 1 :]
        if quantity == "contraction":
            if unit not in _PURE:
                raise InputError(f"{where}: unit {unit!r} is not known; {nearest(unit, _PURE)}")
            return quantity, _PURE[unit]
        if not unit:
            raise InputError(f"{where} has no unit; write it in the name: {_STEMS[quantity][2]!r}")
        return quantity, _SPELLING.get(unit, unit)
    return None, ""


def _number(cell: str, where: str) -> float:
    if not cell:
        raise InputError(f"{where} is empty; fill the gap or drop the row")
    try:
        value = float(cell)
    except ValueError:
        raise InputError(f"{where} = {cell!r} is not a number; write one such as 12.5") from None
    if not math.isfinite(value):
        raise InputError(f"{where} = {cell} is not finite; drop the row")
    return value
