"""A lab's own log: what each of its columns is, by the table ``[columns]`` of its recording.

    [columns]
    time = { column = "t", unit = "ms" }
    "knee.angle" = { column = "calf_deg", unit = "deg", sign = -1, offset = 90 }
    "flexor.pressure" = { column = "p1", unit = "psi", absolute = true }
    "flexor.pressure_set" = { column = "p1_cmd", unit = "bar" }

The number of a quantity is sign x (number in the log) + offset in the unit stated, less the
atmosphere where pressures are absolute. A clock that begins again at 0 after a whole time states
it, ``time = { column = "t", unit = "s", wraps = 2 }``, and goes on from there.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError, nearest
from pamsim.core.units import to_si
from pamsim.recordings.columns import Columns
from pamsim.recordings.signal_names import EFFORTS, JOINT_KINDS, KINDS, MUSCLE_COLUMNS, owner_of

ATMOSPHERE = 101325.0
"""Standard atmosphere [Pa], ISO 2533: what an absolute pressure is taken to be above."""

_KEYS = {"column", "unit", "sign", "offset", "absolute"}
_CLOCK_KEYS = _KEYS | {"wraps"}
FloatArray = NDArray[np.float64]

_SHORT = re.compile(r"(.+)_([1-9]\d*)")
_PRESSURES = ("pressure", "pressure_set")


@dataclass(frozen=True, kw_only=True)
class LogColumn:
    """One column of a log.

    Attributes:
        quantity: such as ``knee.angle``.
        name: in pamsim's own format, such as ``knee_deg``.
        column: in the log.
        scale: of a number in the log in the unit of ``name``, sign included.
        offset: in the unit of ``name``.
        wraps: time after which a clock begins again at 0 [s]; 0 if it runs on.
    """

    quantity: str
    name: str
    column: str
    scale: float
    offset: float
    wraps: float = 0.0


def log_columns(table: object, where: str) -> tuple[LogColumn, ...]:
    """Read a table ``[columns]``.

    Args:
        table: quantity -> column, unit, and as needed sign, offset, absolute.
        where: file and table, for errors.

    Raises:
        InputError: for an unknown quantity, key or unit, a sign other than 1 and -1, no clock.
    """
    if not isinstance(table, Mapping) or not table:
        raise InputError(f'{where}: write quantity = {{ column = "...", unit = "..." }}')
    found = tuple(_column(str(q), entry, f"{where}: {q}") for q, entry in table.items())
    if all(one.quantity != "time" for one in found):
        raise InputError(f'{where}: no clock; write time = {{ column = "...", unit = "s" }}')
    return found


def in_own_format(columns: Columns, log: tuple[LogColumn, ...]) -> Columns:
    """A log's table with pamsim's own names and units; columns that are not named are left out.

    Raises:
        InputError: if a column is not there, or a cell is no finite number.
    """
    cells: dict[str, list[str]] = {}
    for one in log:
        columns.require(one.column, f" for {one.quantity}")
        values = columns.numbers(one.column) * one.scale + one.offset
        if one.wraps > 0.0:
            values = _unwrapped(values, one, columns)
        cells[one.name] = [repr(value) for value in values.tolist()]
    named = {one.column for one in log}
    return Columns(
        path=columns.path,
        header=columns.header,
        lines=columns.lines,
        cells=cells,
        ignored=tuple(name for name in columns.cells if name not in named),
    )


def _column(quantity: str, entry: object, where: str) -> LogColumn:
    name, unit_si, shown = _own_name(quantity, where)
    if not isinstance(entry, Mapping):
        raise InputError(f'{where}: write {{ column = "...", unit = "..." }}')
    given: Mapping[str, Any] = entry
    known = _CLOCK_KEYS if quantity == "time" else _KEYS
    for key in given:
        if key not in known:
            raise InputError(f"{where}: unknown key {key}; {nearest(str(key), known)}")
    column, unit = given.get("column"), given.get("unit", "1" if unit_si == "1" else None)
    if not isinstance(column, str) or not isinstance(unit, str):
        raise InputError(f'{where} needs column = "..." and unit = "..."')
    sign, offset = given.get("sign", 1), given.get("offset", 0.0)
    if sign not in (1, -1):
        raise InputError(f"{where}: sign = {sign!r}; write 1 or -1")
    if isinstance(offset, bool) or not isinstance(offset, int | float):
        raise InputError(f"{where}: offset = {offset!r}; write a number in {unit}")
    if not math.isfinite(offset):
        raise InputError(f"{where}: offset = {offset!r} is not finite")
    absolute = given.get("absolute", False)
    if not isinstance(absolute, bool):
        raise InputError(f"{where}: absolute = {absolute!r}; write true or false")
    if absolute and not name.endswith("_kpa"):
        raise InputError(f"{where}: only pressures are absolute or gauge")
    per_unit = to_si(1.0, unit, unit_si, where=where) * shown
    below = ATMOSPHERE * shown if absolute else 0.0
    wraps = given.get("wraps", 0.0)
    if isinstance(wraps, bool) or not isinstance(wraps, int | float) or not 0.0 <= wraps < math.inf:
        raise InputError(f"{where}: wraps = {wraps!r}; write a time in {unit}")
    return LogColumn(
        quantity=quantity,
        name=name,
        column=column,
        scale=sign * per_unit,
        offset=offset * per_unit - below,
        wraps=wraps * per_unit,
    )


def _unwrapped(time: FloatArray, clock: LogColumn, columns: Columns) -> FloatArray:
    """A clock that begins again, running on [s].

    Raises:
        InputError: where it has run beyond the time at which it should have begun again.
    """
    late = np.flatnonzero(time >= clock.wraps)
    if late.size:
        raise InputError(
            f"{columns.path}: line {columns.lines[int(late[0])]}: {clock.column}: the clock is at"
            f" {time[late[0]]:g} s, but should begin again after {clock.wraps:g} s"
        )
    rounds = np.concatenate([[0], np.cumsum(np.diff(time) < 0.0)])
    return time + clock.wraps * rounds


def _own_name(quantity: str, where: str) -> tuple[str, str, float]:
    """Name of a quantity's column, its SI unit, and how many of the column's unit that is."""
    if quantity == "time":
        return "time_s", "s", 1.0
    owner, kind, number = owner_of(quantity), quantity.rpartition(".")[2], ""
    if not owner and (short := _SHORT.fullmatch(quantity)):
        kind, number = short.groups()
    # A joint's force has the column and the unit of a muscle's.
    if kind in (*JOINT_KINDS, *EFFORTS.values()) and (owner or kind != "force") and not number:
        name = f"{owner or kind}_{KINDS[kind].suffix}"
        return name, KINDS[kind].unit, KINDS[kind].scale
    if kind in MUSCLE_COLUMNS and (owner or number):
        numbered, named = MUSCLE_COLUMNS[kind]
        name = named.format(owner) if owner else numbered.format(number)
        if kind in ("valve", "pulse"):
            return name, "1", 1.0
        own = KINDS["pressure" if kind in _PRESSURES else kind]
        return name, own.unit, own.scale
    joints = (*JOINT_KINDS, *EFFORTS.values())
    known = [*(f"JOINT.{kind}" for kind in joints), *(f"MUSCLE.{q}" for q in MUSCLE_COLUMNS)]
    raise InputError(
        f"{where} is no quantity; write time, {', '.join(known)}, or for a rig with one joint"
        " angle, torque, pressure_1, pressure_set_1, valve_1, force_1"
    )
