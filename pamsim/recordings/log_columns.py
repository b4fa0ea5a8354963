"""What the columns of a lab's own log are, as the table ``[columns]`` of its recording says.

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
from dataclasses import replace

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.toml_tables import NUMBER, check_keys, entry
from pamsim.core.units import FloatArray, to_si
from pamsim.recordings.columns import Columns, cells_of
from pamsim.recordings.signals import EFFORTS, JOINT_KINDS, KINDS, MUSCLE_COLUMNS

ATMOSPHERE = 101325.0
"""Standard atmosphere [Pa], ISO 2533: what an absolute pressure is taken to be above."""


def in_own_format(columns: Columns, table: object, where: str) -> Columns:
    """A log's table with pamsim's own names and units; columns that are not named are left out.

    Args:
        columns: of the log.
        table: quantity -> column, unit, and as needed sign, offset, absolute, wraps.
        where: file and table, for errors.

    Raises:
        InputError: for an unknown quantity, key or unit, a sign other than 1 and -1, no clock or
            one that begins again too late, a column that is not there, a cell that is no number.
    """
    if not isinstance(table, Mapping) or not table:
        raise InputError(f'{where}: write quantity = {{ column = "...", unit = "..." }}')
    if "time" not in table:
        raise InputError(f'{where}: no clock; write time = {{ column = "...", unit = "s" }}')
    found = dict(_quantity(columns, str(q), one, f"{where}: {q}") for q, one in table.items())
    named = {one["column"] for one in table.values()}
    ignored = tuple(name for name in columns.cells if name not in named)
    return replace(columns, cells=cells_of(found), ignored=ignored, units={})


def _quantity(columns: Columns, quantity: str, table: object, where: str) -> tuple[str, FloatArray]:
    """Own name and numbers of a quantity."""
    name, si_unit, shown = _own_name(quantity, where)
    if not isinstance(table, Mapping):
        raise InputError(f'{where}: write {{ column = "...", unit = "..." }}')
    clock = ["wraps"] if quantity == "time" else []
    check_keys(table, ("column", "unit", "sign", "offset", "absolute", *clock), where)
    needs = f'{where} needs column = "..." and unit = "..."'
    column: str = entry(table, "column", str, needs)
    unit: str = entry(table, "unit", str, needs, "1" if si_unit == "1" else None)

    def number(key: str, wanted: str, default: float) -> float:
        return entry(table, key, NUMBER, f"{where}: {key} = {{!r}}; write {wanted}", default)

    sign = number("sign", "1 or -1", 1)
    offset = number("offset", f"a number in {unit}", 0.0)
    wraps = number("wraps", f"a time in {unit}", 0.0)
    wanted = f"{where}: absolute = {{!r}}; write true or false"
    absolute: bool = entry(table, "absolute", bool, wanted, False)
    for wrong, why in (
        (sign not in (1, -1), f"sign = {sign!r}; write 1 or -1"),
        (not math.isfinite(offset), f"offset = {offset!r} is not finite"),
        (not 0.0 <= wraps < math.inf, f"wraps = {wraps!r}; write a time in {unit}"),
        (absolute and si_unit != "Pa", "only pressures are absolute or gauge"),
    ):
        if wrong:
            raise InputError(f"{where}: {why}")
    per_unit = to_si(1.0, unit, si_unit, where=where) * shown
    columns.require(column, f" for {quantity}")
    zero = offset * per_unit - (ATMOSPHERE * shown if absolute else 0.0)
    values = columns.numbers(column) * (sign * per_unit) + zero
    if wraps > 0.0:
        end = wraps * per_unit
        late = f"but should begin again after {end:g} s"
        columns.refuse(
            values >= end, lambda i: f"{column}: the clock is at {values[i]:g} s, {late}"
        )
        return name, values + end * np.cumsum(np.diff(values, prepend=values[0]) < 0.0)
    return name, values


def _own_name(quantity: str, where: str) -> tuple[str, str, float]:
    """Name of a quantity's column, its SI unit, and how many of the column's unit that is."""
    joints = (*JOINT_KINDS, *EFFORTS.values())
    owner, _, kind = quantity.rpartition(".")
    numbered = re.fullmatch(r"(.+)_([1-9]\d*)", quantity)
    if quantity == "time":
        return "time_s", "s", 1.0
    if owner and kind in MUSCLE_COLUMNS:
        name = MUSCLE_COLUMNS[kind][1].format(owner)  # a joint's force, too
    elif (owner and kind in joints) or (kind == quantity != "force" and kind in joints):
        name = f"{owner or kind}_{KINDS[kind].suffix}"
    elif numbered and numbered[1] in MUSCLE_COLUMNS:
        kind = numbered[1]
        name = MUSCLE_COLUMNS[kind][0].format(numbered[2])
    else:
        known = [*(f"JOINT.{kind}" for kind in joints), *(f"MUSCLE.{q}" for q in MUSCLE_COLUMNS)]
        raise InputError(
            f"{where} is no quantity; write time, {', '.join(known)}, or for a rig with one joint"
            " angle, torque, pressure_1, pressure_set_1, valve_1, force_1"
        )
    own = KINDS.get(kind.removesuffix("_set"))
    return (name, own.unit, own.scale) if own else (name, "1", 1.0)
