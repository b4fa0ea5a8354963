"""What the columns of a lab's own log are, as the table ``[columns]`` of its recording says.

    [columns]
    time = { column = "t", unit = "ms" }
    "knee.angle" = { column = "calf_deg", unit = "deg", sign = -1, offset = 90 }
    "flexor.pressure" = { column = "p1", unit = "psi", absolute = true }
    "flexor.pressure_set" = { column = "p1_cmd", unit = "bar" }
    "knee.torque" = { column = "F", unit = "N", times = "0.0069 m" }

The number of a quantity is sign x (number in the log) + offset in the unit stated, times a factor
with a unit of its own, less the standard atmosphere where pressures are absolute. Columns of a file
without header are ``column_1`` and so on. Rows of one time stamp are spread evenly up to the next.
A clock that begins again at 0 after a whole time states it, ``time = { column = "t", unit = "s",
wraps = 2 }``, and goes on from there; rows without a clock state ``time = { rate = "200 Hz" }``.
"""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.toml_tables import NUMBER, Entry, check_table
from pamsim.core.units import FloatArray, number_and_unit, parse_quantity, to_si
from pamsim.physics.air import ATMOSPHERE
from pamsim.recordings.columns import Columns, cells_of
from pamsim.recordings.signals import EFFORTS, JOINT_KINDS, KINDS, NUMBERED, column_of, kind_of

_JOINT = (*JOINT_KINDS, *EFFORTS.values())
_COLUMN = {
    "column": Entry(),
    "unit": Entry(),
    "sign": Entry(NUMBER, "1 or -1", 1, lambda sign: sign in (1, -1)),
    "offset": Entry(NUMBER, "a finite number in the column's unit", 0.0, math.isfinite),
    "absolute": Entry(bool, "true or false", False),
    "times": Entry(str, 'a number with a unit, such as "0.0069 m"', "1"),
}
_CLOCK = {
    **_COLUMN,
    "wraps": Entry(NUMBER, "a time in the column's unit", 0.0, lambda end: 0.0 <= end < math.inf),
}
_RATE = {"rate": Entry(str, 'a rate such as "200 Hz"')}


def in_own_format(columns: Columns, table: object, where: str) -> Columns:
    """A log's table with pamsim's own names and units; columns that are not named are left out.

    ``table`` has quantity -> column, unit, and as needed sign, offset, times, absolute, wraps; or
    time -> rate. It stands ``where`` errors say.

    Raises:
        InputError: for an unknown quantity, key or unit, a sign other than 1 and -1, no clock or
            one that begins again too late, a column that is not there, a cell that is no number.
    """
    if not isinstance(table, dict) or "time" not in table:
        raise InputError(f'{where}: no clock; write time = {{ column = "...", unit = "s" }}')
    found: dict[str, FloatArray] = {}
    used: set[str] = set()
    turned: set[str] = set()
    notes: tuple[str, ...] = ()
    for quantity, one in table.items():
        place = f"{where}: {quantity}"
        if quantity == "time" and isinstance(one, dict) and "rate" in one:
            found["time_s"] = _by_rate(one, len(columns.lines), place)
            continue
        name, values, column, sign = _quantity(columns, str(quantity), one, place)
        if quantity == "time":
            values, repeated = _spread(values)
            notes += (f"{repeated} rows repeat a time stamp: spread evenly",) * (repeated > 0)
        found[name] = values
        used.add(column)
        if sign < 0:
            turned.add(name)
    ignored = tuple(name for name in columns.cells if name not in used)
    return replace(
        columns,
        cells=cells_of(found),
        ignored=ignored,
        units={},
        notes=notes,
        turned=frozenset(turned),
    )


def unwrapped(time: FloatArray, end: float) -> FloatArray:
    """Times that run on, of a clock that begins again at 0 after ``end``."""
    return time + end * np.cumsum(np.diff(time, prepend=time[0]) < 0.0)


def _by_rate(table: object, rows: int, where: str) -> FloatArray:
    """Times of the rows of a log without a clock [s]."""
    rate: str = check_table(table, _RATE, where)["rate"]
    hertz = parse_quantity(rate, "Hz", "Hz", where=f"{where}: rate")
    if not 0.0 < hertz < math.inf:
        raise InputError(f"{where}: rate = {rate!r} must be above 0 Hz")
    return np.arange(rows) / hertz


def _spread(time: FloatArray) -> tuple[FloatArray, int]:
    """Times of rows whose clock is coarser than the rows, and how many repeated a time stamp.

    Rows of one time stamp are spread evenly up to the next, or over the usual step between stamps,
    if that is shorter: a gap of the log stays one.
    """
    first = np.flatnonzero(np.diff(time, prepend=math.nan) != 0.0)
    stamps = time[first]
    if not 1 < first.size < time.size:
        return time, 0
    usual = float(np.median(np.diff(stamps)))
    lasts = np.minimum(np.diff(stamps, append=math.inf), usual)
    count = np.diff(first, append=time.size)
    place = np.arange(time.size) - np.repeat(first, count)
    return np.repeat(stamps, count) + place * np.repeat(lasts / count, count), (
        time.size - first.size
    )


def _quantity(
    columns: Columns, quantity: str, table: object, where: str
) -> tuple[str, FloatArray, str, float]:
    """Own name and numbers of a quantity, the column that it is in, and with which sign."""
    name, si_unit, shown = _own_name(quantity, where)
    known = _CLOCK if quantity == "time" else _COLUMN
    if si_unit == "1":
        known = {**known, "unit": Entry(default="1")}
    stated = check_table(table, known, where)
    if stated["absolute"] and si_unit != "Pa":
        raise InputError(f"{where}: `absolute` is for pressures only; leave it out")
    factor, of_factor = number_and_unit(stated["times"], where=f"{where}: times")
    unit = f"{stated['unit']}*({of_factor})" if of_factor else stated["unit"]
    per_unit = to_si(1.0, unit, si_unit, where=where) * shown * factor
    column: str = stated["column"]
    columns.require(column, f" for {quantity}")
    zero = stated["offset"] * per_unit - (ATMOSPHERE * shown if stated["absolute"] else 0.0)
    values = columns.numbers(column) * (stated["sign"] * per_unit)
    if columns.instants(column) is not None and (quantity != "time" or per_unit != 1.0):
        raise InputError(f"{where}: {column!r} holds dates: it is the time in s")
    end = stated.get("wraps", 0.0) * per_unit
    if end > 0.0:
        late = f"but should begin again after {end:g} s"
        columns.refuse(
            values >= end, lambda i: f"{column}: the clock is at {values[i]:g} s, {late}"
        )
        values = unwrapped(values, end)
    return name, values + zero, column, stated["sign"]


def _own_name(quantity: str, where: str) -> tuple[str, str, float]:
    """Name of a quantity's column, its SI unit, and how many of the column's unit that is."""
    if quantity == "time":
        return "time_s", "s", 1.0
    owner, _, kind = quantity.rpartition(".")
    numbered = re.fullmatch(r"(.+)_[1-9]\d*", quantity)
    if owner:
        known = kind in (*NUMBERED, *_JOINT)
    else:
        known = numbered[1] in NUMBERED if numbered else quantity in ("angle", "position", "torque")
    if not known:
        every = [*(f"JOINT.{kind}" for kind in _JOINT), *(f"MUSCLE.{q}" for q in NUMBERED)]
        raise InputError(
            f"{where} is no quantity; write time, {', '.join(every)}, or for a rig with one joint"
            " angle, torque, pressure_1, pressure_set_1, valve_1, force_1"
        )
    own = KINDS.get(kind_of(quantity))
    return (column_of(quantity), own.unit, own.scale) if own else (column_of(quantity), "1", 1.0)
