"""A table of any columns, as a data logger or another program writes it, as trials.

No rig is assumed: any sample time, any names, any units. Rows may be named by a clock in any unit
of time or by dates, or follow each other at a known interval.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from datetime import datetime
from itertools import pairwise

import numpy as np

from pamsim.core.errors import InputError, nearest
from pamsim.core.units import FloatArray, to_si
from pamsim.identification.frequency_table import is_over_frequency
from pamsim.identification.records import HOLDS
from pamsim.identification.signals import SignalTable, Unit
from pamsim.recordings.column_guess import kind_of_unit, unit_in_name, unit_of
from pamsim.recordings.columns import Columns
from pamsim.recordings.recording_checks import LONGEST_GAP

# A column counts as held from row to row with up to this share of distinct values. That it jumps
# from row to row does not count: the public heat exchanger's flow does, and held it predicts worse.
_FEW_VALUES = 0.1
_CLOCK = re.compile(
    r"(?:(?:elapsed|relative|simulation)?[ _]?time|t|timestamp|clock|zeit|elapsed|date(?:time)?)"
    r"(?:[ _]*[\[(/_ ] *(?P<unit>[^\W\d]+) *[\])]?)?",
    re.IGNORECASE,
)
_NUMBERS = re.compile(
    r"|#|k|n|no\.?|i|row|index|sample|samples|unnamed: 0", re.IGNORECASE
)  # names of what numbers the rows
_SPANS: Mapping[str, float] = {
    unit: seconds
    for units, seconds in (
        ("ns", 1e-9),
        ("us µs μs", 1e-6),
        ("ms msec", 1e-3),
        ("s sec seconds", 1.0),
        ("min minutes", 60.0),
        ("h hr hours", 3600.0),
        ("d days", 86400.0),
    )
    for unit in units.split()
}
"""Unit of a clock -> [s]."""
_NAMED_BY_UNIT = {"s", "sec", "seconds", "ms", "msec", "min", "minutes", "hours", "days"}
_EVEN = 1e-6  # of the time between rows: a clock that is off by less is even
_DECIMAL = re.compile(r"[-+]?\d*\.?(\d*)(?:e([-+]?\d+))?", re.IGNORECASE)
_DAY = 86400.0  # [s]
_OF_DAY = re.compile(r"(\d+):([0-5]\d):([0-5]\d(?:\.\d+)?)")
_SI_UNITS = {"pressure": "Pa", "angle": "rad", "position": "m", "force": "N", "torque": "N*m"}
_OTHER_UNITS = {"v": "V", "a": "A", "w": "W", "hz": "Hz", "rpm": "rpm", "degc": "degC"}
"""Units in which a name may end, beside those of rigs."""


def plain_trials(
    table: Columns, *, time: str | None = None, dt: float | None = None, hold: str | None = None
) -> tuple[tuple[SignalTable, ...], tuple[str, ...]]:
    """Trials of a table of any columns; ``time``, ``dt`` and ``hold`` as in `identify`.

    Returns:
        One trial, or one for each part between gaps of the clock; and what a reader should know.
    """
    if hold not in (None, *HOLDS):
        raise InputError(f"`hold` {hold!r} is not known; {nearest(hold, HOLDS)}")
    path = table.path
    clocks = ["time_s"]
    if "time_s" not in table.cells:
        clocks = [name for name in _called_clocks(table) if np.all(_steps(table, name) > 0.0)]
    notes: list[str] = []
    if dt is not None:
        if time is not None:
            raise InputError("`time` and `dt` exclude each other; give one of them")
        if not (np.isfinite(dt) and dt > 0.0):
            raise InputError(f"`dt` = {dt:g} s must be above 0")
        seconds = dt * np.arange(len(table.lines))
        notes += [f"{path.name}: rows are {dt:g} s apart; {name} is not used" for name in clocks]
        unused = clocks
    else:
        clock = _the_clock(table, clocks, time)
        seconds, note = _seconds(table, clock)
        unused = [clock]
        notes += [note] if note else []
    # What numbers the rows is no signal.
    numbering = filter(_NUMBERS.fullmatch, table.cells)
    unused += [name for name in numbering if np.all(_steps(table, name) == 1.0)]
    columns: dict[str, FloatArray] = {}
    unreadable: dict[str, str] = {}
    for name in (name for name in table.cells if name not in unused):
        try:
            columns[name] = table.numbers(name)
        except InputError as error:
            unreadable[name] = str(error)
    units = {name: _unit(name, table.units.get(name, "")) for name in columns}
    columns = {name: values * units[name].factor for name, values in columns.items()}
    held = frozenset(columns if hold == "zoh" else ())
    if hold is None:
        few = (n for n, v in columns.items() if np.unique(v).size <= max(2, _FEW_VALUES * v.size))
        held = frozenset(few)
        names = ", ".join(sorted(held)) or "no column"
        notes.append(f"{path.name}: assumed constant from each row to the next: {names}")
    whole = SignalTable(
        name=path.stem,
        protocol=path.stem,
        load=0.0,
        time=seconds - seconds[0],
        columns=columns,
        units=units,
        held=held,
        rest={name: float(columns[name][0]) for name in held},
        level=None,
        unreadable=unreadable,
    )
    trials = _between_gaps(whole)
    if len(trials) > 1:
        notes.append(f"{path.name}: its clock has gaps, which make {len(trials)} trials of it")
    return trials, tuple(notes)


def _called_clocks(table: Columns) -> list[str]:
    return [
        name
        for name in table.cells
        if (_CLOCK.fullmatch(name.strip()) or name.lower() in _NAMED_BY_UNIT)
        and _clock_unit(table, name) in ("", *_SPANS)
    ]


def _clock_unit(table: Columns, name: str) -> str:
    if name.lower() in _NAMED_BY_UNIT:
        return name.lower()
    match = _CLOCK.fullmatch(name.strip())
    named = match["unit"] if match and match["unit"] else unit_in_name(name, "")
    return (table.units.get(name) or named).lower()


def _steps(table: Columns, name: str) -> FloatArray:
    """From each row of a column to the next, in its unit or in seconds; NaN if it is no clock."""
    try:
        return np.diff(_numbers_or_dates(table, name))
    except InputError:
        return np.array([np.nan])


def _the_clock(table: Columns, clocks: list[str], time: str | None) -> str:
    if time is not None:
        table.require(time, " for the time")
        return time
    if len(clocks) == 1:
        return clocks[0]
    first = next(iter(table.cells))
    if table.header == 0 and len(table.cells) > 2 and np.all(_steps(table, first) > 0.0):
        return first  # of a table without names
    if is_over_frequency(table):
        raise InputError(f"{table.path} is a frequency response, not a trial: identify it alone")
    found = f"{' and '.join(clocks)} look like clocks" if clocks else "no column is a clock"
    for name in [] if clocks else _called_clocks(table):
        found += (
            f" ({name} = {table.cells[name][0]}, ...: not rising, or no number, no date as"
            " 2026-03-01 12:30:00 and no time of day)"
        )
    raise InputError(
        f"{table.path}: {found}; give `time`, of {', '.join(table.cells)}, or `dt`, the time"
        " between two rows"
    )


def _seconds(table: Columns, name: str) -> tuple[FloatArray, str]:
    """Times of the rows [s], and a note if the unit is assumed."""
    written, unit = _numbers_or_dates(table, name), _clock_unit(table, name)
    dated = _is_date(table.cells[name][0])
    if not dated and unit not in ("", *_SPANS):
        raise InputError(
            f"{table.path}: {name} is in {unit!r}, which is no unit of time; known:"
            f" {', '.join(_SPANS)}"
        )
    stuck = np.flatnonzero(np.diff(written) <= 0.0)
    if stuck.size:
        row = int(stuck[0]) + 1
        raise InputError(
            f"{table.path}: line {table.lines[row]}: {name} = {table.cells[name][row]} does not"
            " come after the line before; sort the rows and drop repeated times"
        )
    if dated:
        return written, ""
    note = "" if unit else f"{table.path.name}: {name} is taken to be in s"
    return _even(written, table.cells[name]) * _SPANS.get(unit, 1.0), note


def _numbers_or_dates(table: Columns, name: str) -> FloatArray:
    """The cells of a clock as numbers in its unit, or as seconds where they are dates or times."""
    cells = table.cells[name]
    if not _is_date(cells[0]):
        return table.numbers(name)
    try:
        found = np.array([_seconds_since(cell, cells[0]) for cell in cells])
    except (ValueError, TypeError):
        raise InputError(f"{table.path}: {name}: not all cells are dates as {cells[0]}") from None
    if _OF_DAY.fullmatch(cells[0]):  # past midnight a time of day begins again
        found += _DAY * np.cumsum(np.diff(found, prepend=found[0]) < -0.5 * _DAY)
    return found


def _seconds_since(cell: str, first: str) -> float:
    """Time from a date, or a time of day, to another [s]."""
    times = [_OF_DAY.fullmatch(text) for text in (cell, first)]
    if times[0] and times[1]:
        now, before = (3600.0 * int(t[1]) + 60.0 * int(t[2]) + float(t[3]) for t in times if t)
        return now - before
    return (datetime.fromisoformat(cell) - datetime.fromisoformat(first)).total_seconds()


def _is_date(cell: str) -> bool:
    if _OF_DAY.fullmatch(cell):
        return True
    try:
        datetime.fromisoformat(cell)
    except ValueError:
        return False
    return not cell.isdigit()  # 20200101 is a date, too


def _even(time: FloatArray, cells: Iterable[str]) -> FloatArray:
    """The even clock, of which rows may be missing, that reads like this if rounded as written.

    This if there is none.
    """
    if time.size < 3:
        return time
    place = np.array([_last_place(cell) for cell in cells])
    steps = np.diff(time)
    missing = np.append(0.0, np.cumsum(np.maximum(np.round(steps / np.median(steps)), 1.0)))
    for rows in (np.arange(time.size), missing):
        slope, start = np.polyfit(rows, time - time[0], 1)
        even = time[0] + start + slope * rows
        off = np.abs(time - even)
        if np.max(off) <= _EVEN * slope:
            return even
        # Where a row is missing from a finely written clock, the distance is greater.
        if np.median(place) <= 0.5 * slope and np.all(off <= 0.75 * place):
            return even
    return time


def _last_place(cell: str) -> float:
    """Unit in the last place of a number as it is written; 0 of what is no decimal number."""
    match = _DECIMAL.fullmatch(cell)
    return 10.0 ** (int(match[2] or 0) - len(match[1])) if match else 0.0


def _unit(name: str, stated: str) -> Unit:
    written = unit_in_name(name, stated)
    if not written:
        shown = _OTHER_UNITS.get(name.rpartition("_")[2].lower(), "1") if "_" in name else "1"
        return Unit(unit=shown, si_unit=shown)
    shown, _ = unit_of(written)
    si = _SI_UNITS.get(kind_of_unit(written))
    if si is None:
        return Unit(unit=shown, si_unit=shown)
    return Unit(unit=shown, si_unit=si, factor=to_si(1.0, shown, si, where=name))


def _between_gaps(table: SignalTable) -> tuple[SignalTable, ...]:
    steps = np.diff(table.time)
    gaps = np.flatnonzero(steps > LONGEST_GAP * np.median(steps)) + 1 if steps.size else []
    ends = [0, *gaps, table.time.size]
    if len(ends) == 2:
        return (table,)
    parts = (
        table.rows(f"{table.name}_{i}", slice(begin, end))
        for i, (begin, end) in enumerate(pairwise(ends), start=1)
    )
    # Parts of one table follow each other: none repeats another.
    return tuple(replace(part, protocol=part.name) for part in parts)
