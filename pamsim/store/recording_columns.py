"""Columns of one trial's CSV: names that fix quantity and unit, cells that are finite numbers."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError, nearest
from pamsim.store.csv_cells import csv_rows, finite_cell

FloatArray = NDArray[np.float64]

COMMAND_COLUMN = {"valve": "u{}", "pulse": "u{}", "pressure": "p{}_set_kpa"}
"""Kind of command -> its column per muscle, counted from 1."""

_SHAPES = ("time_s", "angle_deg", "u{}", "p{}_set_kpa", "p{}_kpa", "force{}_n")
_KNOWN = re.compile("|".join(shape.replace("{}", r"[1-9]\d*") for shape in _SHAPES))
# The same quantity in another unit, or in none: p1_bar, p1_set, angle_rad, force2.
_STEMS = {
    r"time(_.*)?|t|t_m?s": "time_s",
    r"angle(_.*)?|beta(_.*)?": "angle_deg",
    r"p([1-9]\d*)_set(_.*)?": "p{}_set_kpa",
    r"p([1-9]\d*)(_.*)?": "p{}_kpa",
    r"force([1-9]\d*)(_.*)?|f([1-9]\d*)_k?n": "force{}_n",
    r"u([1-9]\d*)_.*": "u{}",
}
_CLOSE = 0.8  # similarity at which another name is taken for a slip of the pen


@dataclass(frozen=True, kw_only=True)
class TrialColumns:
    """One trial's table as written.

    Attributes:
        path: of the file, for errors.
        lines: line number of each row.
        values: column name -> (n,) in the unit of its name.
        ignored: names of columns that mean nothing here.
    """

    path: Path
    lines: list[int]
    values: Mapping[str, FloatArray]
    ignored: tuple[str, ...]

    def where(self, name: str, row: int) -> str:
        """File, line, column and value of a cell, to begin an error with."""
        return f"{self.path}: line {self.lines[row]}: {name} = {self.values[name][row]:g}"

    def command(self, kind: str) -> list[str]:
        """Names of the command columns, in muscle order.

        Raises:
            InputError: if there is none, or a muscle is left out.
        """
        # A muscle whose pressure was measured must be commanded, too.
        muscles = max([1, *(int(digits) for digits in re.findall(r"\d+", " ".join(self.values)))])
        wanted = [COMMAND_COLUMN[kind].format(muscle) for muscle in range(1, muscles + 1)]
        for name in wanted:
            if name not in self.values:
                have = ", ".join(self.values)
                raise InputError(
                    f"{self.path}: no command column {name!r}, which command = {kind!r} needs:"
                    f" what drives the simulation must be recorded (there are: {have})"
                )
        return wanted


def read_trial_columns(path: Path) -> TrialColumns:
    """Read the CSV of one trial.

    Args:
        path: of the file.

    Returns:
        Its columns as written.

    Raises:
        InputError: in one line with line and column: what `csv_rows` and `finite_cell` refuse, a
            column twice, no ``time_s``, a known quantity in another unit, a name so close to a
            known one that it must be meant.
    """
    (first, header), *rows = csv_rows(path)
    names: dict[int, str] = {}
    ignored: list[str] = []
    for index, name in enumerate(header):
        where = f"{path}: line {first}: column {name!r}"
        if name in header[:index]:
            raise InputError(f"{where} is there twice; keep one")
        if _KNOWN.fullmatch(name):
            names[index] = name
        else:
            _refuse_near(name, where)
            ignored.append(name)
    if "time_s" not in names.values():
        raise InputError(f"{path}: no column 'time_s' (there are: {', '.join(header)})")
    table = np.array(
        [
            [finite_cell(row[index], f"{path}: line {number}: {names[index]}") for index in names]
            for number, row in rows
        ]
    )
    return TrialColumns(
        path=path,
        lines=[number for number, _ in rows],
        values={name: table[:, column] for column, name in enumerate(names.values())},
        ignored=tuple(ignored),
    )


def _refuse_near(name: str, where: str) -> None:
    lower = name.lower()
    for stem, shape in _STEMS.items():
        match = re.fullmatch(stem, lower)
        if match:
            muscle = next((group for group in match.groups() if group and group.isdigit()), "1")
            wanted = shape.format(muscle)
            raise InputError(
                f"{where} is not of this format, whose unit is in the name: convert it if need be"
                f" and name it {wanted!r}"
            )
    known = [shape.format(muscle) for shape in _SHAPES for muscle in ("1", "2")]
    if difflib.get_close_matches(lower, known, n=1, cutoff=_CLOSE):
        raise InputError(f"{where} is not known; {nearest(lower, set(known))}")
