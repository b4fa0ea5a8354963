"""Read the columns of a file: text of any separator, ``.npz``, ``.mat`` or ``.parquet``.

The first line of a text names the columns; blank lines and lines that begin with ``#`` are left
out.
"""

from __future__ import annotations

import contextlib
import csv
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.files import read_bounded
from pamsim.core.limits import (
    LINE_CHARACTERS,
    NAME_CHARACTERS,
    TABLE_BYTES,
    TABLE_CELLS,
    TABLE_COLUMNS,
)
from pamsim.core.units import FloatArray
from pamsim.recordings.array_files import ARRAY_FILES, read_arrays
from pamsim.recordings.columns import Cells, Columns, cells_of

_SMALLER = "cut it into several files, or leave out columns"
_MARKS = ";\t,|"
_AROUND = ' "'  # a number
_NONE = ("", "-", "--", "1")  # in a line of units
_GROUPED = {mark: re.compile(rf"[-+]?[1-9]\d{{0,2}}([{mark}]\d{{3}})+") for mark in ",."}
_UNGROUPED = re.compile(r"[-+]?\d{1,3}")
_SURE = {",": _UNGROUPED, ".": re.compile(r"[-+]?[1-9]\d{2}")}
"""Whole numbers that tell a separator of thousands from a decimal one: a column of 1.125 and 0 is
one of decimal points, a column of 1.125 and 980 is not."""
_DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d*([eE][-+]?\d+)?")


def read_columns(path: Path, *, numbers_only: bool = False) -> Columns:
    """Read a table with a header.

    Cells of a text file are separated by commas, semicolons, tabs, bars or spaces, with decimal
    points, or with decimal commas where no comma separates cells. A line of units may follow the
    header, and lines of another number of cells come before it. With ``numbers_only`` it may be
    without header; its columns are ``column_1``, ... An ``.npz`` or ``.mat`` file has one array per
    column, or it is a ``.parquet`` file.

    Raises:
        InputError: in one line: unreadable file, no header, no row below it, a row of another
            length than the header, arrays of different lengths, a column twice.
    """
    if path.suffix.lower() in ARRAY_FILES:
        return _of_arrays(path)
    numbers, texts = _lines(path)
    start, mark = _header(texts)
    first, header = numbers[start], _split(texts[start], mark)
    _check_size(path, header)
    if numbers_only and _numeric(header):
        first, start = 0, start - 1
        header = [f"column_{i}" for i in range(1, len(header) + 1)]
    lines, texts = numbers[start + 1 :], texts[start + 1 :]
    for line, text in zip(lines, texts, strict=True):
        if (width := _width(text, mark)) != len(header):
            raise InputError(
                f"{path}: line {line} has {width} cells, the header {len(header)}; write points in"
                " numbers, or separate cells by semicolons"
            )
    units: dict[str, str] = {}
    above, *below = (_split(text, mark) for text in texts[:2])
    words = not _is_number(above[0]) and all(c in _NONE or not _is_number(c) for c in above)
    if below and words and _is_number(below[0][0]):
        stated = zip(header, (cell.strip("[]() ") for cell in above), strict=True)
        units = {name: unit for name, unit in stated if unit not in _NONE}
        del lines[0], texts[0]
    if mark != ",":
        _refuse_grouped(path, header, lines, texts, mark)
    found = _numbers(texts, mark)

    def cells(i: int) -> Cells:
        return Cells(found.get(i), len(texts), lambda row: _split(texts[row], mark)[i])

    of_name = {name: cells(i) for i, name in enumerate(header)}
    columns = Columns(path=path, header=first, lines=lines, cells=of_name, units=units)
    columns.refuse_twice(header)
    return columns


def _lines(path: Path) -> tuple[list[int], list[str]]:
    """Number and text of each line that counts."""
    text = _text(path)
    _check_size(path, (), max(map(text.count, _MARKS)) + text.count("\n"))
    rows = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if not (line.lstrip() or "#").startswith("#")
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
    return [number for number, _ in rows], [line for _, line in rows]


def _text(path: Path) -> str:
    try:
        larger = f"save it as Parquet or .npz, or {_SMALLER}"
        written = read_bounded(path, TABLE_BYTES, instead=larger)
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


def _header(texts: Sequence[str]) -> tuple[int, str | None]:
    """Place of the header among the lines of a file, and the mark between its cells.

    The header is the first line with as many cells as a row, if it comes before all rows: what
    loggers write above is no table.
    """
    half = len(texts) // 2
    for start, line in enumerate(texts[:half]):
        mark = _mark(line)
        cells = _split(line, mark)
        if any(cells) and _numeric(filter(None, cells)):
            break
        if len(cells) == _width(texts[half], mark) > 1:
            return start, mark
    return 0, _mark(texts[0])


def _mark(line: str) -> str | None:
    return next((mark for mark in _MARKS if mark in line), None)


def _refuse_grouped(
    path: Path, header: Sequence[str], lines: Sequence[int], texts: Sequence[str], mark: str | None
) -> None:
    """Refuse marks that group the digits of whole numbers; they would be read as decimal ones.

    They do so in a column where all of them stand before three digits and whole numbers without one
    have three digits at most.
    """
    for group in ",.":
        if group == "." and len({text.count(group) for text in texts}) == 1:
            continue
        first: dict[int, int] = {}  # column -> row of its first mark
        without: set[int] = set()
        possible = set(range(len(header)))
        for row, text in enumerate(texts):
            cells = text.split(mark)
            for i in list(possible):
                cell = cells[i].strip(_AROUND)
                if _GROUPED[group].fullmatch(cell):
                    first.setdefault(i, row)
                elif not _UNGROUPED.fullmatch(cell):
                    possible.remove(i)
                elif _SURE[group].fullmatch(cell):
                    without.add(i)
            if not possible:
                break
        for i in sorted(possible & without & first.keys()):
            cell = texts[first[i]].split(mark)[i].strip(_AROUND)
            raise InputError(
                f"{path}: line {lines[first[i]]}: {header[i]} = {cell} looks like"
                f" {cell.replace(group, '')} with a separator of thousands, and would be read as"
                f" {cell.replace(group, '.', 1)}; write numbers without separators"
            )


def _numbers(texts: list[str], mark: str | None) -> dict[int, FloatArray]:
    """The columns of numbers among lines, by place.

    numpy's reader takes a fraction of the time that splitting each line does, but no column that
    holds both numbers and words.
    """
    sample = [i for i, cell in enumerate(_split(texts[-1], mark)) if _is_number(cell)]
    points = texts if mark == "," else [text.replace(",", ".") for text in texts]
    try:
        read = np.loadtxt(
            points, delimiter=mark, usecols=sample, comments=None, quotechar='"', ndmin=2
        )
        if len(read) < len(texts):
            raise ValueError("a quote that is not closed")  # which numpy closes lines further down
        return dict(zip(sample, np.ascontiguousarray(read.T), strict=True))
    except ValueError:
        found: dict[int, FloatArray] = {}
        for i, column in enumerate(zip(*(_split(text, mark) for text in texts), strict=True)):
            with contextlib.suppress(ValueError):
                found[i] = np.array(column, dtype=float)
        return found


def _split(line: str, mark: str | None) -> list[str]:
    """The cells of a line; a decimal comma in them becomes a point."""
    if mark is None:
        cells = line.split()
    else:
        quoted = '"' in line
        cells = next(csv.reader([line], delimiter=mark)) if quoted else line.split(mark)
        cells = [cell.strip() for cell in cells]
    return cells if mark == "," or "," not in line else list(map(_with_point, cells))


def _with_point(cell: str) -> str:
    return cell.replace(",", ".") if _DECIMAL_COMMA.fullmatch(cell) else cell


def _width(line: str, mark: str | None) -> int:
    return len(_split(line, mark)) if mark is None or '"' in line else line.count(mark) + 1


def _is_number(cell: str) -> bool:
    try:
        float(_with_point(cell))
    except ValueError:
        return False
    return True


def _numeric(cells: Iterable[str]) -> bool:
    return all(map(_is_number, cells))


def _check_size(path: Path, names: Sequence[str], cells: int = 0) -> None:
    longest = max(map(len, names), default=0)
    if cells > TABLE_CELLS:
        raise InputError(
            f"{path} has about {cells:,} cells; a table has {TABLE_CELLS:,} at most: {_SMALLER}"
        )
    if len(names) > TABLE_COLUMNS:
        raise InputError(
            f"{path} has {len(names):,} columns; a table has {TABLE_COLUMNS:,} at most"
        )
    if longest > NAME_CHARACTERS:
        raise InputError(f"{path}: the name of a column has {longest:,} characters; shorten it")


def _of_arrays(path: Path) -> Columns:
    """The arrays of a file of another format; what is no list of numbers is left out, with a note.

    On and off count as 1 and 0.
    """
    arrays = read_arrays(path)
    lists = {
        name: array.ravel().astype(float)
        for name, array in arrays.items()
        if array.dtype.kind in "biuf" and array.ndim and array.size == max(array.shape) > 1
    }
    if not lists:
        raise InputError(f"{path}: no array of numbers; give one per column, all of one length")
    _check_size(path, list(lists), sum(map(len, lists.values())))
    rows = max(map(len, lists.values()))
    for name, array in lists.items():
        if len(array) != rows:
            raise InputError(
                f"{path}: {name} has {len(array)} numbers, another array {rows}; a table's"
                " columns are of one length"
            )
    left_out = ", ".join(name for name in arrays if name not in lists)
    notes = (f"not used, no list of numbers: {left_out}",) if left_out else ()
    lines = range(1, rows + 1)
    return Columns(path=path, header=1, lines=lines, cells=cells_of(lists), notes=notes)
