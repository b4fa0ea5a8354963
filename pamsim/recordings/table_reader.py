"""Read the columns of a file: text of any separator, ``.npz``, ``.mat`` or ``.parquet``.

The first line of a text names the columns; blank lines and lines that begin with ``#`` are left
out.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Sequence
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
_NONE = ("", "-", "--")  # in a line of units
_DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d*([eE][-+]?\d+)?")


def read_columns(path: Path, *, numbers_only: bool = False) -> Columns:
    """Read a table with a header.

    Args:
        path: of a text file, its cells separated by commas, semicolons, tabs, bars or spaces, with
            decimal points, or with decimal commas where no comma separates cells; a line of units
            may follow the header, and lines of another number of cells come before it. Or of an
            ``.npz`` or ``.mat`` file with one array per column, or of a ``.parquet`` file.
        numbers_only: whether a text file may be without header; its columns are ``column_1``, ...

    Raises:
        InputError: in one line: unreadable file, no header, no row below it, a row of another
            length than the header, arrays of different lengths, a column twice.
    """
    if path.suffix.lower() in ARRAY_FILES:
        return _of_arrays(path)
    rows = _rows(path)
    start, separator = _header(rows)
    first, header = rows[start][0], _split(rows[start][1], separator)
    _check_names(path, header)
    if numbers_only and all(map(_is_number, header)):
        start, first = start - 1, 0
        header = [f"column_{i}" for i in range(1, len(header) + 1)]
    lines, texts = [n for n, _ in rows[start + 1 :]], [text for _, text in rows[start + 1 :]]
    for line, text in zip(lines, texts, strict=True):
        if (cells := _width(text, separator)) != len(header):
            raise InputError(
                f"{path}: line {line} has {cells} cells, the header {len(header)}; write points in"
                " numbers, or separate cells by semicolons"
            )
    units: dict[str, str] = {}
    if len(texts) > 1:
        above, below = (_split(text, separator) for text in texts[:2])
        if not any(map(_is_number, above)) and _is_number(below[0]):
            stated = zip(header, (cell.strip("[]() ") for cell in above), strict=True)
            units = {name: unit for name, unit in stated if unit not in _NONE}
            del lines[0], texts[0]
    cells = dict(zip(header, _of_text(texts, separator, len(header)), strict=True))
    columns = Columns(path=path, header=first, lines=lines, cells=cells, units=units)
    columns.refuse_twice(header)
    return columns


def _rows(path: Path) -> list[tuple[int, str]]:
    """Number and text of each line that counts."""
    text = _text(path)
    _check_size(path, max(map(text.count, _MARKS)) + text.count("\n"))
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
    return rows


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


def _header(rows: Sequence[tuple[int, str]]) -> tuple[int, str | None]:
    """Place of the header among the lines of a file, and the mark between its cells.

    The header is the first line with as many cells as a row, if it comes before all rows: what
    loggers write above is no table.
    """
    among = rows[len(rows) // 2][1]
    for start, (_, line) in enumerate(rows[: len(rows) // 2]):
        cells = _split(line, _mark(line))
        if all(map(_is_number, cells)):
            break
        if len(cells) == _width(among, _mark(line)) > 1:
            return start, _mark(line)
    return 0, _mark(rows[0][1])


def _mark(line: str) -> str | None:
    return next((mark for mark in _MARKS if mark in line), None)


def _of_text(texts: list[str], separator: str | None, width: int) -> list[Cells]:
    """The columns of lines; numpy's reader takes them unless a column holds both numbers and words.

    It takes a fraction of the time that splitting each line in Python does.
    """
    sample = [i for i, cell in enumerate(_split(texts[-1], separator)) if _is_number(cell)]
    decimal = texts if separator == "," else [text.replace(",", ".") for text in texts]
    numbers: dict[int, FloatArray] = {}
    try:
        read = np.loadtxt(
            decimal, delimiter=separator, usecols=sample, comments=None, quotechar='"', ndmin=2
        )
        numbers = dict(zip(sample, np.ascontiguousarray(read.T), strict=True))
    except ValueError:
        for i, column in enumerate(zip(*(_split(text, separator) for text in texts), strict=True)):
            try:
                numbers[i] = np.array(column, dtype=float)
            except ValueError:
                continue

    def written(column: int) -> Callable[[int], str]:
        return lambda row: _split(texts[row], separator)[column]

    return [Cells(numbers.get(i), len(texts), written(i)) for i in range(width)]


def _split(line: str, separator: str | None) -> list[str]:
    """The cells of a line; a decimal comma in them becomes a point."""
    if separator is None:
        cells = line.split()
    else:
        quoted = '"' in line
        cells = next(csv.reader([line], delimiter=separator)) if quoted else line.split(separator)
        cells = [cell.strip() for cell in cells]
    return cells if separator == "," or "," not in line else list(map(_with_point, cells))


def _with_point(cell: str) -> str:
    return cell.replace(",", ".") if _DECIMAL_COMMA.fullmatch(cell) else cell


def _width(line: str, separator: str | None) -> int:
    if separator is None or '"' in line:
        return len(_split(line, separator))
    return line.count(separator) + 1


def _is_number(cell: str) -> bool:
    try:
        float(_with_point(cell))
    except ValueError:
        return False
    return True


def _check_size(path: Path, cells: int) -> None:
    if cells > TABLE_CELLS:
        raise InputError(
            f"{path} has about {cells:,} cells; a table has {TABLE_CELLS:,} at most: {_SMALLER}"
        )


def _check_names(path: Path, names: Sequence[str]) -> None:
    count, longest = len(names), max(map(len, names))
    if count > TABLE_COLUMNS:
        raise InputError(f"{path} has {count:,} columns; a table has {TABLE_COLUMNS:,} at most")
    if longest > NAME_CHARACTERS:
        raise InputError(f"{path}: the name of a column has {longest:,} characters; shorten it")


def _of_arrays(path: Path) -> Columns:
    """The arrays of a file of another format; what is no list of numbers is left out."""
    lists = {
        name: array.ravel().astype(float)
        for name, array in read_arrays(path).items()
        if array.dtype.kind in "iuf" and array.ndim and array.size == max(array.shape) > 1
    }
    if not lists:
        raise InputError(f"{path}: no array of numbers; give one per column, all of one length")
    _check_names(path, list(lists))
    _check_size(path, sum(map(len, lists.values())))
    rows = max(map(len, lists.values()))
    for name, array in lists.items():
        if len(array) != rows:
            raise InputError(
                f"{path}: {name} has {len(array)} numbers, another array {rows}; a table's"
                " columns are of one length"
            )
    return Columns(path=path, header=1, lines=range(1, rows + 1), cells=cells_of(lists))
