"""Which column of a trial's file is which command and which measured channel.

A file in pamsim's own format has its muscles either by number (``u1``, ``p1_set_kpa``, ``p1_kpa``,
``force1_n``, with one joint's ``angle_deg``) or by name (``flexor_valve``, ``flexor_set_kpa``,
``flexor_kpa``, ``flexor_n``, with ``knee_deg`` of a joint that turns and ``slider_mm`` of one that
slides). The command columns decide.

What the columns of a lab's own log are stands in the table ``[columns]`` of its recording:

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
from dataclasses import dataclass, replace

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.toml_tables import NUMBER, check_keys, entry
from pamsim.core.units import FloatArray, to_si
from pamsim.recordings.columns import Columns, cells_of
from pamsim.recordings.signals import (
    EFFORTS,
    JOINT_KINDS,
    KINDS,
    MUSCLE_COLUMNS,
    MUSCLE_DRIVES,
    Drive,
    DriveLike,
    column_of,
    command_columns,
    muscle_channels,
    muscle_columns,
    owner_of,
)

ATMOSPHERE = 101325.0
"""Standard atmosphere [Pa], ISO 2533: what an absolute pressure is taken to be above."""

_KEYS = ("column", "unit", "sign", "offset", "absolute")
_NUMBERED = (
    "time_s",
    "angle_deg",
    "torque_nm",
    *dict.fromkeys(n for n, _ in MUSCLE_COLUMNS.values()),
)
_BY_NUMBER = re.compile(r"u\d+|p\d+(_set)?_kpa")
_SHORT = re.compile(r"(.+)_([1-9]\d*)")


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
    found = tuple(_log_column(str(q), one, f"{where}: {q}") for q, one in table.items())
    if all(one.quantity != "time" for one in found):
        raise InputError(f'{where}: no clock; write time = {{ column = "...", unit = "s" }}')
    return found


def _log_column(quantity: str, table: object, where: str) -> LogColumn:
    name, si_unit, shown = _own_name(quantity, where)
    if not isinstance(table, Mapping):
        raise InputError(f'{where}: write {{ column = "...", unit = "..." }}')
    check_keys(table, (*_KEYS, *(["wraps"] if quantity == "time" else [])), where)
    needs = f'{where} needs column = "..." and unit = "..."'
    column: str = entry(table, "column", str, needs)
    unit: str = entry(table, "unit", str, needs, "1" if si_unit == "1" else None)
    sign: float = entry(table, "sign", NUMBER, f"{where}: sign = {{!r}}; write 1 or -1", 1)
    wanted = f"{where}: offset = {{!r}}; write a number in {unit}"
    offset: float = entry(table, "offset", NUMBER, wanted, 0.0)
    wanted = f"{where}: absolute = {{!r}}; write true or false"
    absolute: bool = entry(table, "absolute", bool, wanted, False)
    wanted = f"{where}: wraps = {{!r}}; write a time in {unit}"
    wraps: float = entry(table, "wraps", NUMBER, wanted, 0.0)
    if sign not in (1, -1):
        raise InputError(f"{where}: sign = {sign!r}; write 1 or -1")
    if not math.isfinite(offset):
        raise InputError(f"{where}: offset = {offset!r} is not finite")
    if not 0.0 <= wraps < math.inf:
        raise InputError(f"{where}: wraps = {wraps!r}; write a time in {unit}")
    if absolute and not name.endswith("_kpa"):
        raise InputError(f"{where}: only pressures are absolute or gauge")
    per_unit = to_si(1.0, unit, si_unit, where=where) * shown
    return LogColumn(
        quantity=quantity,
        name=name,
        column=column,
        scale=sign * per_unit,
        offset=offset * per_unit - (ATMOSPHERE * shown if absolute else 0.0),
        wraps=wraps * per_unit,
    )


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
        own = KINDS[kind.removesuffix("_set")]
        return name, own.unit, own.scale
    joints = (*JOINT_KINDS, *EFFORTS.values())
    known = [*(f"JOINT.{kind}" for kind in joints), *(f"MUSCLE.{q}" for q in MUSCLE_COLUMNS)]
    raise InputError(
        f"{where} is no quantity; write time, {', '.join(known)}, or for a rig with one joint"
        " angle, torque, pressure_1, pressure_set_1, valve_1, force_1"
    )


def in_own_format(columns: Columns, log: tuple[LogColumn, ...]) -> Columns:
    """A log's table with pamsim's own names and units; columns that are not named are left out.

    Raises:
        InputError: if a column is not there, or a cell is no finite number.
    """
    found: dict[str, FloatArray] = {}
    for one in log:
        columns.require(one.column, f" for {one.quantity}")
        found[one.name] = columns.numbers(one.column) * one.scale + one.offset
        if one.wraps > 0.0:
            found[one.name] = _unwrapped(found[one.name], one, columns)
    named = {one.column for one in log}
    ignored = tuple(name for name in columns.cells if name not in named)
    return replace(columns, cells=cells_of(found), ignored=ignored, units={})


def _unwrapped(time: FloatArray, clock: LogColumn, columns: Columns) -> FloatArray:
    """A clock that begins again, running on [s]."""
    late = np.flatnonzero(time >= clock.wraps)
    if late.size:
        raise InputError(
            f"{columns.path}: line {columns.lines[int(late[0])]}: {clock.column}: the clock is at"
            f" {time[late[0]]:g} s, but should begin again after {clock.wraps:g} s"
        )
    rounds = np.concatenate([[0], np.cumsum(np.diff(time) < 0.0)])
    return time + clock.wraps * rounds


@dataclass(frozen=True, kw_only=True)
class TrialColumns:
    """The columns of one trial's file.

    Attributes:
        columns: those that the format knows.
        muscles: names, in the order of their commands; none where muscles have numbers.
        drives: of each muscle and driven joint.
        command: column of each muscle's command, then of each driven joint; empty of one without.
        channels: column -> measured channel; also of columns that are not there.
    """

    columns: Columns
    muscles: tuple[str, ...]
    drives: Drive
    command: tuple[str, ...]
    channels: Mapping[str, str]


def trial_columns(columns: Columns, drive: DriveLike) -> TrialColumns:
    """Find the columns of a trial in those of its file, by what drives it.

    Raises:
        InputError: if there is no command, a muscle is left out of it, or a column's name is so
            close to a known one that it must be meant.
    """
    muscles = _names(columns, drive)
    named = any(cell.startswith(f"{muscle}_") for muscle in muscles for cell in columns.cells)
    if not named or any(map(_BY_NUMBER.fullmatch, columns.cells)):
        columns, muscles = columns.select(_NUMBERED), ()
        # A muscle whose pressure was measured must be commanded, too.
        count = max([1, *map(int, re.findall(r"\d+", " ".join(columns.cells)))])
    else:
        count = len(muscles)
    drives = Drive.of(drive, count if isinstance(drive, str) else len(drive))

    def of_muscles(kind: str) -> dict[str, str]:
        own = muscle_columns(kind, muscles, len(drives.muscles))
        return dict(zip(own, muscle_channels(kind, muscles, len(drives.muscles)), strict=True))

    command = command_columns(drives, muscles)
    if muscles:
        joints = _joints_by_name(columns, drives)
    else:
        shown = ("angle", "torque") if drives.joints else ("angle",)
        joints = {column_of(channel): channel for channel in shown}
    channels = {**of_muscles("pressure"), **joints, **of_muscles("force")}
    if muscles:
        own = [column for column in command if column]
        known = (name for q in MUSCLE_COLUMNS for name in muscle_columns(q, muscles, count))
        columns = columns.select(("time_s", *own, *channels, *known))
    given: list[str] = []  # from outside, which is no measurement of the rig
    for name, kind in zip(command, drives.kinds, strict=True):
        if name and name not in columns.cells:
            have = ", ".join((*columns.cells, *columns.ignored))
            raise InputError(
                f"{columns.path}: no command column {name!r}, which drive = {kind!r} needs: what"
                f" drives the simulation must be recorded (there are: {have})"
            )
        if kind in EFFORTS.values():
            given.append(name)
    return TrialColumns(
        columns=columns,
        muscles=muscles,
        drives=drives,
        command=command,
        channels={column: c for column, c in channels.items() if column not in given},
    )


def _names(columns: Columns, drive: DriveLike) -> tuple[str, ...]:
    """Names of the muscles: those of the drive, or those of columns that hold it."""
    if not isinstance(drive, str):
        return tuple(name for name, kind in drive.items() if kind in MUSCLE_DRIVES)
    named = MUSCLE_COLUMNS[MUSCLE_DRIVES[drive].quantity or "pressure"][1]
    found = [re.fullmatch(named.replace("{}", "(.+?)"), name) for name in columns.cells]
    return tuple(match[1] for match in found if match and not match[1].endswith("_set"))


def _joints_by_name(columns: Columns, drives: Drive) -> dict[str, str]:
    """Column -> channel of joints that turn or slide, and of what acts on them."""
    found: dict[str, str] = {}
    for kind in (*JOINT_KINDS, "torque"):
        end = f"_{KINDS[kind].suffix}"
        names = [name for name in columns.cells if name.endswith(end)]
        found |= {name: f"{name.removesuffix(end)}.{kind}" for name in names}
    return found | {f"{joint}_n": f"{joint}.force" for joint in drives.joints}
