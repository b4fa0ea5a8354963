"""Rows and cells of a CSV file, each with its line number for errors."""

from __future__ import annotations

import csv
import math
from pathlib import Path

from pamsim.core.errors import InputError


def csv_rows(path: Path) -> list[tuple[int, list[str]]]:
    """The rows of a CSV file, blank lines and lines that begin with ``#`` left out.

    Args:
        path: of the file, UTF-8 with or without byte-order mark.

    Returns:
        Line number and stripped cells of each row, the header first.

    Raises:
        InputError: in one line: unreadable file, no header, cells separated by semicolons, no row
            below the header, a row of another length than the header.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise InputError(f"{path} is not a text file; give a CSV in UTF-8") from None
    rows = [
        (number, [cell.strip() for cell in next(csv.reader([line]))])
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not rows:
        raise InputError(f"{path}: no header; the first line names the columns, such as time_s")
    first, header = rows[0]
    if len(header) == 1 and ";" in header[0]:
        raise InputError(
            f"{path}: line {first}: cells are separated by semicolons; write commas between cells"
            " and points in numbers"
        )
    if len(rows) == 1:
        raise InputError(f"{path}: no rows below the header in line {first}")
    for number, row in rows[1:]:
        if len(row) != len(header):
            raise InputError(
                f"{path}: line {number} has {len(row)} cells, the header {len(header)}; write"
                " points, not commas, in numbers"
            )
    return rows


def finite_cell(cell: str, where: str) -> float:
    """A cell as a finite number.

    Args:
        cell: stripped text.
        where: file, line and column, for the error.

    Raises:
        InputError: for an empty cell, text, NaN or infinity.
    """
    if not cell:
        raise InputError(f"{where} is empty; fill the gap or drop the row")
    try:
        value = float(cell)
    except ValueError:
        raise InputError(f"{where} = {cell!r} is not a number; write one such as 12.5") from None
    if not math.isfinite(value):
        raise InputError(f"{where} = {cell} is not finite; drop the row")
    return value
