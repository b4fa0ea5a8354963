"""The printed operating points of a result: checked once, then used by table, figures and CSV."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from pamsim.core.errors import InputError
from pamsim.report.numbers import number_or_none

SIZES = ("large", "medium", "small")


@dataclass(frozen=True, kw_only=True)
class OperatingPoint:
    """One printed row and what the simulation made of it, in the units of the print.

    Attributes:
        row: number in the paper's tables, 1 to 24.
        table: 1 or 2.
        size: of the pressure step: ``large``, ``medium`` or ``small``.
        p1_kpa: gauge pressure of muscle 1 after the step [kPa].
        p2_kpa: of muscle 2 [kPa].
        load_kg: mass on the arm [kg].
        measured_deg: printed angle [deg].
        simulated_deg: simulated angle at the end; None if the run has none [deg].
        error_deg: simulated minus measured [deg].
        start_p1_kpa: pressure before the step [kPa].
        start_p2_kpa: pressure before the step [kPa].
        settling_s: settling time [s].
        overshoot_percent: beyond the final angle, of the whole movement [%].
        monotonic: whether the response never turns back.
        repeats: number of the row that this one repeats.
        slip: a misprint in this row, as a sentence.
        outcome: how the run ended.
        message: the outcome as a sentence.
    """

    row: int
    table: int
    size: str
    p1_kpa: float
    p2_kpa: float
    load_kg: float
    measured_deg: float
    simulated_deg: float | None = None
    error_deg: float | None = None
    start_p1_kpa: float | None = None
    start_p2_kpa: float | None = None
    settling_s: float | None = None
    overshoot_percent: float | None = None
    monotonic: bool | None = None
    repeats: int | None = None
    slip: str = ""
    outcome: str = "completed"
    message: str = ""

    @property
    def p_svd_kpa(self) -> float:
        """The paper's input, p1 - p2 [kPa]."""
        return self.p1_kpa - self.p2_kpa

    @property
    def completed(self) -> bool:
        """Whether the simulation ran to its end."""
        return self.outcome == "completed"


COLUMNS = tuple(field.name for field in fields(OperatingPoint))
_REQUIRED = COLUMNS[: COLUMNS.index("simulated_deg")]
_TEXT = ("slip", "outcome", "message")


def parse_rows(result: Mapping[str, Any]) -> list[OperatingPoint]:
    """Read ``result["rows"]``; keys that this version does not know are left alone.

    Args:
        result: of schema ``pamsim-reproduce/1``.

    Returns:
        The operating points in the order given.

    Raises:
        InputError: if there are no rows, or one lacks a value that every row must have.
    """
    rows = result.get("rows")
    if not rows:
        raise InputError("the result has no rows: nothing to report; run the reproduction first")
    return [_parse_row(index, row) for index, row in enumerate(rows)]


def _parse_row(index: int, row: Mapping[str, Any]) -> OperatingPoint:
    missing = [name for name in _REQUIRED if row.get(name) is None]
    if missing:
        raise InputError(f"rows[{index}] of the result lacks {', '.join(missing)}")
    if row["size"] not in SIZES:
        raise InputError(
            f"rows[{index}] of the result has size {row['size']!r}; known: {', '.join(SIZES)}"
        )
    known = {name: row[name] for name in COLUMNS if row.get(name) is not None}
    for name in COLUMNS[len(_REQUIRED) :]:
        if name not in _TEXT and not isinstance(known.get(name), bool | int):
            known[name] = number_or_none(known.get(name))
    return OperatingPoint(**known)


def distinct(points: Sequence[OperatingPoint]) -> list[OperatingPoint]:
    """The points that are not printed repetitions of others."""
    return [point for point in points if point.repeats is None]


def write_rows_csv(points: Sequence[OperatingPoint], path: Path) -> None:
    """Write one line per printed row; the unit is the end of each column's name.

    Args:
        points: the rows.
        path: file to write. A value that does not exist is an empty cell.
    """
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for point in points:
            writer.writerow(_cell(getattr(point, name)) for name in COLUMNS)


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    # repr keeps every digit: a reader can recompute each error and the RMS exactly.
    return repr(value) if isinstance(value, float) else str(value)
