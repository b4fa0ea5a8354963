"""A log with what another logger or a schedule of commands adds, as one table on its clock."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from pamsim.comparison.clock_fit import ClockFit, fit_clock
from pamsim.core.errors import InputError
from pamsim.core.files import complete_file
from pamsim.core.units import FloatArray, parse_quantity, to_si
from pamsim.recordings.column_guess import guess_columns
from pamsim.recordings.columns import Columns
from pamsim.recordings.signals import SignalNames
from pamsim.recordings.table_reader import read_columns

_ANY = 1e6
"""Pressure of a supply [Pa] for the guesses of columns, of which only the clock is taken."""


def join_all(
    logs: Sequence[Path],
    others: Sequence[Path],
    folder: Path,
    *,
    names: SignalNames,
    shared: str,
    offset: str,
) -> tuple[list[Path], list[str]]:
    """Join each log with that of another logger, as `join_logs`, in a folder.

    Returns:
        The files written, and what was found of the clocks of each.

    Raises:
        InputError: as `join_logs`, or if there is not one for each, or for an offset without
            meaning, such as ``1.25 s`` has.
    """
    known = parse_quantity(offset, "s", "s", where="`offset`") if offset else None
    join = partial(join_logs, names=names, shared=shared, offset=known)
    return _each(logs, others, "`beside` them", folder, "{}_and_{}.csv", join)


def schedule_all(
    logs: Sequence[Path],
    schedules: Sequence[Path],
    folder: Path,
    names: SignalNames,
    offset: str,
) -> tuple[list[Path], list[str]]:
    """Join each log with its schedule of commands, as `with_schedule`, in a folder.

    Returns:
        The files written, and what was made of each schedule.

    Raises:
        InputError: as `with_schedule`, or if there is not one for each, or for an offset without
            meaning.
    """
    known = parse_quantity(offset, "s", "s", where="`offset`") if offset else 0.0
    join = partial(with_schedule, names=names, offset=known)
    return _each(logs, schedules, "`schedule`", folder, "{}_commanded.csv", join)


def _each(
    logs: Sequence[Path],
    tables: Sequence[Path],
    what: str,
    folder: Path,
    name: str,
    join: Callable[[Path, Path, Path], str],
) -> tuple[list[Path], list[str]]:
    if len(tables) != len(logs):
        raise InputError(f"{len(logs)} logs and {len(tables)} {what}; give one for each")
    pairs = list(zip(logs, tables, strict=True))
    files = [folder / name.format(log.stem, table.stem) for log, table in pairs]
    return files, [join(*pair, out) for pair, out in zip(pairs, files, strict=True)]


def join_logs(
    log: Path,
    beside: Path,
    out: Path,
    *,
    names: SignalNames,
    shared: str = "",
    offset: float | None,
) -> str:
    """Write the rows of a log with what a second logger recorded at the same times.

    The columns of the second are interpolated, so that rows outside of it are left out, as are
    columns that are no numbers. A name that both have ends in ``_2`` in the second's.

    Args:
        log: a table with a clock that runs on.
        beside: another, with a clock of its own.
        out: CSV file to write.
        names: of the rig's signals, to know the clocks by.
        shared: columns of both with one signal, ``sync=trigger``, or ``sync`` if they have one
            name; the offset is found by it.
        offset: or what the first clock shows when the second is at 0 [s].

    Returns:
        What was found of the clocks, in a sentence.

    Raises:
        InputError: for a log that cannot be read or has no clock, a column that is not there, a
            shared signal by which no offset is certain, or logs that have no time in common.
    """
    first, second = (read_columns(path, numbers_only=True) for path in (log, beside))
    (_, time), (other_clock, other) = (_clock(table, names) for table in (first, second))
    own, equals, other_own = (part.strip() for part in shared.partition("="))
    pair = (own, other_own if equals else own) if shared else ()
    if pair:
        for table, column in zip((first, second), pair, strict=True):
            table.require(column, " to find the offset of the clocks by")
        try:
            fit = fit_clock(time, first.numbers(pair[0]), other, second.numbers(pair[1]))
        except InputError as error:
            raise InputError(f"{log} and {beside}: {shared} {error}") from None
        found = _words(fit, shared)
    elif offset is None:
        raise InputError(
            f"{beside}: nothing lays its clock beside that of {log}; name a signal that both have"
            " recorded by `shared`, or state `offset`"
        )
    else:
        fit = ClockFit(offset=offset, offset_error=0.0)
        found = f"an offset of {offset:.6g} s as stated"
    at = fit.offset + fit.rate * other
    both = (time >= at[0]) & (time <= at[-1])
    if np.count_nonzero(both) < 2:
        raise InputError(
            f"{log} and {beside} have no time in common: the second runs from {at[0]:.4g} to"
            f" {at[-1]:.4g} s of the first, which has {time[0]:.4g} to {time[-1]:.4g} s"
        )
    columns = {name: values[both] for name, values in _numbers(first, ()).items()}
    units = dict(first.units)
    for name, values in _numbers(second, (other_clock, *pair[1:])).items():
        free = name if name not in columns else f"{name}_2"
        columns[free] = np.interp(time[both], at, values)
        units[free] = second.units.get(name, "")
    _write(out, columns, units)
    return f"{beside.name} lies beside {log.name} by {found}"


def with_schedule(
    log: Path, schedule: Path, out: Path, *, names: SignalNames, offset: float = 0.0
) -> str:
    """Write the rows of a log with what was commanded meanwhile, as a schedule states it.

    Each row of the schedule holds until the next. A command of the log is its mean until the next
    sample, so that a pulse that is shorter than a sample lets as much air through.

    Args:
        log: a table with a clock that runs on.
        schedule: a table of times and commands, with a clock of its own.
        out: CSV file to write.
        names: of the rig's signals, to know the clocks by.
        offset: what the log's clock shows when the schedule is at 0 [s].

    Returns:
        What was made of it, in a sentence.

    Raises:
        InputError: for a table that cannot be read or has no clock, a column that both have, or a
            schedule that begins after the log.
    """
    first, second = (read_columns(path, numbers_only=True) for path in (log, schedule))
    (_, time), (clock, other) = (_clock(table, names) for table in (first, second))
    begins = other + offset
    if begins[0] > time[0]:
        raise InputError(
            f"{schedule} begins at {begins[0]:.4g} s of {log}, which begins at {time[0]:.4g} s;"
            " add a row with what was commanded before, or state another `offset`"
        )
    columns, commanded = _numbers(first, ()), _numbers(second, (clock,))
    twice = sorted(columns.keys() & commanded.keys())
    if twice:
        raise InputError(f"{schedule}: {twice[0]} is a column of {log}, too; rename or remove it")
    samples = np.append(time, 2.0 * time[-1] - time[-2])
    last = max(samples[-1], begins[-1]) + 1.0
    for name, values in commanded.items():
        # The integral of what is held is linear in between.
        amount = np.append(0.0, np.cumsum(values * np.diff(np.append(begins, last))))
        columns[name] = np.diff(np.interp(samples, np.append(begins, last), amount))
        columns[name] /= np.diff(samples)
    _write(out, columns, {**second.units, **first.units})
    shortest, sample = np.diff(other).min(initial=np.inf), np.diff(time).max()
    text = f"{schedule.name} is what was commanded: {', '.join(commanded)}"
    if shortest < sample:
        text += (
            f"; it changes within {shortest * 1e3:.3g} ms, in samples of {sample * 1e3:.3g} ms as"
            " their mean: give a higher `rate` if it matters when"
        )
    return text


def _write(out: Path, columns: Mapping[str, FloatArray], units: Mapping[str, str]) -> None:
    with complete_file(out) as part, part.open("w", encoding="utf-8", newline="") as text:
        table = csv.writer(text)
        table.writerow(columns)
        if any(units.get(name) for name in columns):
            table.writerow([units.get(name) or "-" for name in columns])
        table.writerows(zip(*(map(repr, v.tolist()) for v in columns.values()), strict=True))


def _words(fit: ClockFit, shared: str) -> str:
    fast = 1e6 * (1.0 / fit.rate - 1.0)
    return (
        f"an offset of {fit.offset:.4f} +- {fit.offset_error:.2g} s, its clock"
        f" {abs(fast):.0f} +- {1e6 * fit.rate_error:.0f} ppm {'fast' if fast > 0.0 else 'slow'},"
        f" by {shared} (correlation {fit.correlation:.4f})"
    )


def _clock(table: Columns, names: SignalNames) -> tuple[str, FloatArray]:
    """Column of a log's clock, and its times [s]."""
    guesses, _ = guess_columns(table, names, supply=_ANY)
    one = next((guess for guess in guesses if guess.quantity == "time"), None)
    if one is None:
        raise InputError(f"{table.path}: no clock among {', '.join(table.cells)}; name it time_s")
    time = to_si(1.0, one.unit, "s", where=str(table.path)) * table.numbers(one.column)
    table.refuse(
        np.diff(time, prepend=-np.inf) <= 0.0,
        lambda i: f"{one.column}: the clock stands or runs back at {time[i]:g} s",
    )
    return one.column, time


def _numbers(table: Columns, without: tuple[str, ...]) -> dict[str, FloatArray]:
    numbers = {name: c.numbers for name, c in table.cells.items() if name not in without}
    return {name: v for name, v in numbers.items() if v is not None and np.isfinite(v).all()}
