"""A log with what another logger or a schedule of commands adds, as one table on its clock."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import replace
from itertools import count
from pathlib import Path

import numpy as np

from pamsim.comparison.clock_fit import ClockFit, fit_clock
from pamsim.core.errors import InputError
from pamsim.core.files import complete_file
from pamsim.core.units import FloatArray
from pamsim.recordings.column_guess import Guess, guess_columns
from pamsim.recordings.columns import Columns
from pamsim.recordings.log_columns import unwrapped
from pamsim.recordings.recording_checks import LONGEST_GAP
from pamsim.recordings.signals import MUSCLE_DRIVES, SignalNames
from pamsim.recordings.table_reader import read_columns

_ANY = 1e6
"""Pressure of a supply [Pa] for the guesses of columns, of which no unit of pressure is taken."""
_ROUNDING = 1e-6
"""Times this near are one [s]: clocks that count from 1970 round to less, and valves are slower."""
_HELD = {name for name, drive in MUSCLE_DRIVES.items() if not drive.between}
"""Quantities of muscles of which each row holds until the next."""


def join_each(
    logs: Sequence[Path],
    tables: Sequence[Path],
    folder: Path,
    join: Callable[[Path, Path, Path], str],
    *,
    what: str,
    name: str,
) -> tuple[list[Path], list[str]]:
    """Join each log with a table of its own, and write the results into a folder.

    Args:
        logs: tables with clocks that run on.
        tables: one for each.
        folder: for the files.
        join: `join_logs` or `with_schedule`, of a log, its table and the file to write.
        what: the tables, for a message.
        name: of a file, with ``{}`` for those of the log and the table.

    Returns:
        The files written, and what was found of each.

    Raises:
        InputError: if there is not one for each, or as ``join`` does.
    """
    if len(tables) != len(logs):
        raise InputError(f"{len(logs)} logs and {len(tables)} {what}; give one for each")
    files: list[Path] = []
    found: list[str] = []
    for log, table in zip(logs, tables, strict=True):
        own, other = (without_number(path.stem) for path in (log, table))
        # The log's number comes last, as in its own name.
        files.append(folder / f"{name.format(own, other)}{log.stem.removeprefix(own)}.csv")
        found.append(join(log, table, files[-1]))
    return files, found


def without_number(stem: str) -> str:
    """The name of a log without the number at its end, by which repeats differ."""
    return re.sub(r"[\W_]*\d+$", "", stem) or stem


def join_logs(
    log: Path,
    beside: Path,
    out: Path,
    *,
    names: SignalNames,
    stated: Sequence[Guess] = (),
    shared: str = "",
    offset: float | None,
    wraps: float = 0.0,
) -> str:
    """Write the rows of a log with what a second logger recorded at the same times.

    The columns of the second are interpolated, but for commands, which hold until its next row.
    Rows outside of it are left out, as are columns that are no numbers. A name that both have ends
    in ``_2`` in the second's, or in the next number that is free.

    Args:
        log: a table with a clock that runs on.
        beside: another, with a clock of its own.
        out: CSV file to write.
        names: of the rig's signals, to know clocks and commands by.
        stated: what is known of columns, by their names in the file written; of a clock, in both.
        shared: columns of both with one signal, ``sync=trigger``, or ``sync`` if they have one
            name; the offset is found by it.
        offset: or what the first clock shows when the second is at 0 [s].
        wraps: after which the log's clock begins again; 0 for one that runs on [s].

    Returns:
        What was found of the clocks, and which columns are left out, in a sentence.

    Raises:
        InputError: for a log that cannot be read or has no clock, a column that is not there, a
            stated one that is no numbers, a second log with a gap, a shared signal by which no
            offset is certain, or logs that have no time in common.
    """
    first, second = _read(log, beside, stated)
    _, time = _clock(first, names, stated, wraps=wraps)
    other_clock, other = _clock(second, names, stated)
    steps = np.diff(other, prepend=other[0])
    usual = float(np.median(steps[1:])) if other.size > 1 else 0.0
    second.refuse(
        steps > LONGEST_GAP * usual,
        lambda i: (
            f"the clock jumps from {other[i - 1]:g} to {other[i]:g} s, {steps[i] / usual:.3g} times"
            " its usual step, and nothing is known in between; split both logs there, or give what"
            " lists commands alone as `schedule`"
        ),
    )
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
            f"{beside}: the offset of its clock from that of {log} is unknown; name a signal that"
            " both have recorded by `shared`, or state `offset`"
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
    columns = {name: values[both] for name, values in _numbers(first).items()}
    added = _numbers(second, other_clock, *pair[1:])
    called = {name: _free(name, columns, added) for name in added}
    renamed = replace(
        second,
        cells={new: second.cells[name] for name, new in called.items()},
        units={new: second.units.get(name, "") for name, new in called.items()},
    )
    commands = {
        one.column
        for one in _guesses(renamed, names, stated)
        if one.quantity.rpartition(".")[2] in _HELD
    }
    latest = np.searchsorted(at, time[both] + _ROUNDING, "right") - 1
    for name, new in called.items():
        held, between = added[name][latest], np.interp(time[both], at, added[name])
        columns[new] = held if new in commands else between
    _write(out, columns, {**first.units, **renamed.units})
    return f"{beside.name} lies beside {log.name} by {found}{_left_out(first, second)}"


def with_schedule(
    log: Path,
    schedule: Path,
    out: Path,
    *,
    names: SignalNames,
    stated: Sequence[Guess] = (),
    offset: float = 0.0,
    rate: float | None = None,
    wraps: float = 0.0,
) -> str:
    """Write the rows of a log with what was commanded meanwhile, as a schedule states it.

    Each row of the schedule holds until the next. A command of the log is its mean until the next
    sample, so that a pulse that is shorter than a sample lets as much air through.

    Args:
        log: a table with a clock that runs on.
        schedule: a table of times and commands, with a clock of its own.
        out: CSV file to write.
        names: of the rig's signals, to know the clocks by.
        stated: what is known of columns; of a clock, in both tables.
        offset: what the log's clock shows when the schedule is at 0 [s].
        rate: of the rows of a log without a clock, which begins at 0 then [Hz].
        wraps: after which the log's clock begins again; 0 for one that runs on [s].

    Returns:
        What was made of it, and which columns are left out, in a sentence.

    Raises:
        InputError: for a table that cannot be read or has no clock, a stated column that is no
            numbers, a column that both have, or a schedule that begins after the log.
    """
    first, second = _read(log, schedule, stated)
    _, time = _clock(first, names, stated, rate=rate, wraps=wraps)
    clock, other = _clock(second, names, stated)
    if time.size < 2:
        raise InputError(f"{log}: a single row; a schedule needs a log of two or more")
    samples = np.append(time, 2.0 * time[-1] - time[-2])
    begins = _on_samples(other + offset, samples)
    if begins[0] > time[0]:
        raise InputError(
            f"{schedule} begins at {begins[0]:.4g} s of {log}, which begins at {time[0]:.4g} s;"
            " add a row with what was commanded before, or state another `offset`"
        )
    columns, commanded = _numbers(first), _numbers(second, clock)
    twice = sorted(columns.keys() & commanded.keys())
    if twice:
        raise InputError(f"{schedule}: {twice[0]} is a column of {log}, too; rename or remove it")
    inside = begins[(begins > samples[0]) & (begins < samples[-1])]
    edges = np.union1d(samples, inside)
    row = np.searchsorted(begins, edges[:-1], "right") - 1
    start = np.searchsorted(edges, time)
    at_start = np.repeat(row[start], np.diff(start, append=row.size))
    for name, values in commanded.items():
        # From the command at its start, a sample's mean is exact where nothing changes within it.
        change = np.add.reduceat((values[row] - values[at_start]) * np.diff(edges), start)
        columns[name] = values[row[start]] + change / np.diff(samples)
    _write(out, columns, {**second.units, **first.units})
    shortest, sample = np.diff(other).min(initial=np.inf), np.diff(time).max()
    text = f"{schedule.name} is what was commanded: {', '.join(commanded)}"
    if shortest < sample - _ROUNDING:
        text += (
            f"; it changes within {shortest * 1e3:.3g} ms, in samples of {sample * 1e3:.3g} ms as"
            " their mean: sample the log faster if it matters when"
        )
    if other.size > 1 and begins[-1] <= time[0]:
        text += "; the log begins after its last row, which holds throughout: check `offset`"
    return text + _left_out(first, second)


def _on_samples(times: FloatArray, samples: FloatArray) -> FloatArray:
    """Times, but for rounding the samples' own: else a command would change twice."""
    after = np.searchsorted(samples, times - _ROUNDING)
    nearest = samples[np.minimum(after, samples.size - 1)]
    return np.where(np.abs(times - nearest) <= _ROUNDING, nearest, times)


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


def _read(log: Path, other: Path, stated: Sequence[Guess]) -> tuple[Columns, Columns]:
    """Both tables; a stated column that is no numbers is refused, others may be left out."""
    first, second = (read_columns(path, numbers_only=True) for path in (log, other))
    for one in stated:
        table = first if one.column in first.cells else second
        if one.column in table.cells:
            table.numbers(one.column)
    return first, second


def _guesses(table: Columns, names: SignalNames, stated: Sequence[Guess]) -> tuple[Guess, ...]:
    own = [one for one in stated if one.column in table.cells]
    guesses, _ = guess_columns(table, names, supply=_ANY, stated=own)
    return guesses


def _clock(
    table: Columns,
    names: SignalNames,
    stated: Sequence[Guess],
    *,
    rate: float | None = None,
    wraps: float = 0.0,
) -> tuple[str, FloatArray]:
    """Column of a log's clock, and its times [s]; without such a column, by the rate."""
    clocks = [one for one in stated if one.quantity == "time"]
    one = next((one for one in _guesses(table, names, clocks) if one.quantity == "time"), None)
    if one is None and rate is not None:
        if not 0.0 < rate < np.inf:
            raise InputError(f"{table.path}: a `rate` of {rate:g} Hz; it must be above 0")
        return "", np.arange(len(table.lines)) / rate
    if one is None:
        raise InputError(
            f"{table.path}: no clock among {', '.join(table.cells)}; name it, such as `columns`"
            " time=t:s, or call it time_s"
        )
    unit = one.sign * one.seconds(f"{table.path}: {one.column}")
    time = unwrapped(unit * table.numbers(one.column), wraps)
    table.refuse(
        np.diff(time, prepend=-np.inf) <= 0.0,
        lambda i: f"{one.column}: the clock stands or runs back at {time[i]:g} s",
    )
    return one.column, time


def _free(name: str, taken: Container[str], others: Container[str]) -> str:
    """A name, or with a number behind it if it is taken, one that is not among others either."""
    if name not in taken:
        return name
    numbered = (f"{name}_{number}" for number in count(2))
    return next(new for new in numbered if new not in taken and new not in others)


def _numbers(table: Columns, *without: str) -> dict[str, FloatArray]:
    numbers = {name: c.numbers for name, c in table.cells.items() if name not in without}
    return {name: v for name, v in numbers.items() if v is not None and np.isfinite(v).all()}


def _left_out(*tables: Columns) -> str:
    """The columns that `_numbers` leaves out, to end a sentence with."""
    text = ""
    for table in tables:
        names = ", ".join(name for name in table.cells if name not in _numbers(table))
        if names:
            text += f"; not used, not all cells of {table.path.name} are numbers: {names}"
        text += "".join(f"; {table.path.name}: {note}" for note in table.notes)
    return text
