"""From trials and tables to inputs and an output: expressions over columns, in SI."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pamsim.core.errors import InputError, nearest
from pamsim.core.units import FloatArray
from pamsim.identification.records import SignalRecord
from pamsim.inference.record_checks import UNIFORM_TOLERANCE
from pamsim.recordings.signals import KINDS, MUSCLE_DRIVES, column_of, command_columns
from pamsim.recordings.start_pressures import start_pressure
from pamsim.recordings.trial import Trial

_TERM = re.compile(r"\s*([+-]?)\s*([^\W\d]\w*)")
# A first command this close to the rest value is no step: as a share of the input's span, and in
# SI, for the noise of the sensor that measures the rest value.
_SMALL_JUMP = 0.05
_ROWS_AT_REST = 5
_SENSOR_NOISE = {"Pa": 2e3}


@dataclass(frozen=True, kw_only=True)
class Unit:
    """Unit of a column."""

    # as the column has it, such as ``kPa``; ``1`` of a pure number or an unknown unit
    unit: str = "1"
    si_unit: str = "1"  # such as ``Pa``; that shown, of a unit that is not converted
    factor: float = 1.0  # SI per shown unit


# Ending of a column's name in a recording -> its unit; valves have none.
_UNITS = {
    kind.suffix: Unit(unit=kind.shown, si_unit=kind.unit, factor=1.0 / kind.scale)
    for kind in KINDS.values()
}
_IN_AND_OUT = (("u", "y"), ("input", "output"))


@dataclass(frozen=True, kw_only=True)
class SignalTable:
    """Named columns of one trial, from a recording or a plain table."""

    name: str  # of the trial
    protocol: str  # trials of one protocol repeat each other
    load: float  # mass on the arm [kg]
    time: FloatArray  # (n,) [s]
    columns: Mapping[str, FloatArray]  # name -> (n,) [SI]
    units: Mapping[str, Unit]  # by name
    held: frozenset[str]  # names of columns that a computer held from sample to sample
    rest: Mapping[str, float]  # name of a held column -> its value before the trial began [SI]
    level: FloatArray | None  # (n,) mean gauge pressure of the muscles [Pa], or None
    moving: bool = False  # whether it begins in any state, not at rest: a part of a longer trial
    # name of a column that is no signal -> why
    unreadable: Mapping[str, str] = field(default_factory=dict)

    def rows(self, name: str, part: slice) -> SignalTable:
        """Some of its rows, which follow each other, as a trial."""
        columns = {column: values[part] for column, values in self.columns.items()}
        first = not part.start
        return replace(
            self,
            name=name,
            time=self.time[part] - self.time[part][0],
            columns=columns,
            rest=self.rest if first else {c: float(columns[c][0]) for c in self.rest},
            level=None if self.level is None else self.level[part],
            moving=self.moving or not first,
        )


@dataclass(frozen=True, kw_only=True)
class Signal(Unit):
    """A sum or difference of columns of one unit: the user's text, signs and column names."""

    text: str
    terms: tuple[tuple[float, str], ...]

    def of(self, values: Mapping[str, FloatArray] | Mapping[str, float]) -> FloatArray:
        """Evaluate on columns [SI]."""
        return np.sum([sign * np.asarray(values[name]) for sign, name in self.terms], axis=0)


@dataclass(frozen=True, kw_only=True, eq=False)
class UsedTrial:
    """All columns of a trial, and the inputs and output that are used, uniformly sampled."""

    table: SignalTable
    record: SignalRecord


def signal(text: str, tables: Sequence[SignalTable]) -> Signal:
    """Read the name of a column, whatever it looks like, or names joined by ``+`` and ``-``."""
    known = sorted({name for table in tables for name in table.columns})
    if text.strip() in known:
        terms = [(1.0, text.strip())]
    elif re.fullmatch(rf"(?:{_TERM.pattern})(?:\s*[+-]\s*[^\W\d]\w*)*\s*", text):
        terms = [(-1.0 if sign == "-" else 1.0, name) for sign, name in _TERM.findall(text)]
    else:
        terms = [(1.0, text.strip())] if text.strip() in _unreadable(tables) else []
    if not terms:
        raise InputError(
            f"{text!r} is no signal: give one column, or join names by + and -, such as"
            f" p1_set_kpa-p2_set_kpa; {nearest(text, known)}"
        )
    for _, name in terms:
        without = [table for table in tables if name not in table.columns]
        if without and name in without[0].unreadable:
            raise InputError(without[0].unreadable[name])
        if name not in known:
            raise InputError(f"no column {name!r}; {nearest(name, known)}")
        if without:
            raise InputError(
                f"column {name!r} is not in trial {without[0].name!r}; exclude that trial"
            )
    units = {table.units[name] for table in tables for _, name in terms}
    if len(units) > 1:
        raise InputError(
            f"{text!r} combines {' and '.join(sorted(one.unit for one in units))}; use columns"
            " of one unit"
        )
    return Signal(text=text, terms=tuple(terms), **vars(units.pop()))


def chosen_signals(
    tables: Sequence[SignalTable], given: Sequence[str], explained: str | None
) -> tuple[tuple[str, ...], str, str]:
    """Inputs and output, those that are left out by default.

    By default they are what a recording commands and measures; of two columns that are called
    otherwise, the first is the input and the second the output.

    Returns:
        Inputs, output, and a note on what was assumed, or nothing.
    """
    for text in (*given, explained):
        if text:
            signal(text, tables)  # what is given must be there
    if given and explained:
        return tuple(given), explained, ""
    # Columns of every trial.
    have = [name for name in tables[0].columns if all(name in t.columns for t in tables)]
    try:
        inputs = tuple(given) or (default_input(have),)
        return inputs, explained or default_output(have), ""
    except InputError as error:
        lower = {name.lower(): name for name in have}
        named = (pair for pair in _IN_AND_OUT if set(pair) <= set(lower))
        pair = next((tuple(lower[name] for name in pair) for pair in named), tuple(have))
        # One of them may be given, as it stands.
        if len(pair) != 2 or not {*given, explained} - {None} <= set(pair) or len(given) > 1:
            # With why a column that one might have meant is no signal.
            reasons = list(_unreadable(tables).values())[:1]
            texts = [str(error), *reasons] if len(have) > 1 or not reasons else reasons
            raise InputError("; ".join(texts)) from None
    first, second = pair
    if second in given or explained == first:
        first, second = second, first
    return (first,), second, f"{first} is taken as the input and {second} as the output"


def _unreadable(tables: Sequence[SignalTable]) -> dict[str, str]:
    return {name: why for table in tables for name, why in table.unreadable.items()}


def default_input(have: Sequence[str]) -> str:
    """Of columns the pressure difference that was set, else the difference of the valves.

    Of a recording whose muscles have names, the difference of the two commands, or the only one.
    """
    for shape in ("p{}_set_kpa", "u{}", "p{}_kpa"):
        pair = [shape.format(1), shape.format(2)]
        if all(name in have for name in pair):
            return "-".join(pair)
    first = [name for name in have if name in ("p1_set_kpa", "u1", "p1_kpa")][:1]
    named = first or [name for name in have if re.fullmatch(r".+_set_kpa|.+_valve", name)]
    if named and len(named) <= 2:
        return "-".join(named)
    if len(have) == 1:
        raise InputError(
            f"the only column is {have[0]}; a model needs an input: record commands or pressures"
        )
    raise InputError(
        f"no column is known as the command: give `input`, a column or a difference as in p1-p2,"
        f" and `output` unless it is angle_deg; columns: {', '.join(have)}"
    )


def default_output(have: Sequence[str]) -> str:
    """Of columns ``angle_deg``, or the only joint."""
    joints = [name for name in have if re.fullmatch(r".+_(deg|mm)", name)]
    if "angle_deg" in have:
        joints = ["angle_deg"]
    if len(joints) == 1:
        return joints[0]
    raise InputError(f"no angle_deg in every trial: give `output`; columns: {', '.join(have)}")


def table_of(trial: Trial) -> SignalTable:
    """The columns of a trial, under the names of the recording format."""
    driven = command_columns(trial.drives, trial.muscle_names)
    commands = {name: v for name, v in zip(driven, trial.command.T, strict=True) if name}
    measured = {column_of(channel): values for channel, values in trial.measured.items()}
    pressed = [MUSCLE_DRIVES[kind].unit == "Pa" for kind in trial.drives.muscles]
    rest = trial.command[0].copy()
    for muscle, by_pressure in enumerate(pressed):
        rest[muscle] = start_pressure(trial, muscle) if by_pressure else 0.0
    pressures = [
        trial.measured.get(channel, command if by_pressure else None)
        for channel, command, by_pressure in zip(
            trial.pressure_channels, trial.command.T, pressed, strict=False
        )
    ]
    known = [values for values in pressures if values is not None]
    return SignalTable(
        name=trial.name,
        protocol=trial.protocol,
        load=trial.load,
        time=trial.time,
        columns={**commands, **measured},
        units={
            name: _UNITS.get(name.rpartition("_")[2], Unit()) for name in (*commands, *measured)
        },
        held=frozenset(commands),
        rest={name: v for name, v in zip(driven, rest.tolist(), strict=True) if name},
        level=np.mean(known, axis=0) if known else None,
    )


def used_trial(
    table: SignalTable, inputs: Sequence[Signal], out: Signal, *, held_out: bool = False
) -> tuple[UsedTrial, str]:
    """Inputs and output of one trial.

    Where a held input already differs in the first row from where the trial rests, five rows at
    rest are put before it: that is how a step at time 0 becomes visible, to ARX models as well,
    whose first equations need rows of the past. A note says if its clock was not uniform. Inputs of
    a trial that is ``held_out`` may be constant.

    Raises:
        InputError: for a trial of one row, or that `SignalRecord` refuses.
    """
    if table.time.size < 2:
        raise InputError(f"trial {table.name}: one row alone shows no change; exclude it")
    held = [all(name in table.held for _, name in into.terms) for into in inputs]
    time, output = table.time, out.of(table.columns)
    given = np.column_stack([into.of(table.columns) for into in inputs])
    steps = np.diff(time)
    interval, note = float(np.median(steps)), ""
    if np.max(np.abs(steps - np.mean(steps))) > UNIFORM_TOLERANCE * np.mean(steps):
        count = int((time[-1] - time[0]) / interval * (1.0 + 1e-12)) + 1
        even = time[0] + interval * np.arange(count)
        # A held command is that of the last row; a measured signal is interpolated.
        last = np.maximum(np.searchsorted(time, even * (1.0 + 1e-12), side="right") - 1, 0)
        pairs = zip(given.T, held, strict=True)
        given = np.column_stack(
            [values[last] if still else np.interp(even, time, values) for values, still in pairs]
        )
        output = np.interp(even, time, output)
        note = f"{table.name}: interpolated to a uniform step of {interval:.4g} s"
        if even.size > time.size:
            note += (
                f"; {even.size - time.size} of {even.size} rows are missing, and an input may have"
                " changed in one: poles and dead times of a few steps may be wrong"
            )
        time = even
    at_rest = [
        _at_rest(table, into, values) if still else float(values[0])
        for into, values, still in zip(inputs, given.T, held, strict=True)
    ]
    if np.any(at_rest != given[0]):
        before = np.arange(-_ROWS_AT_REST, 0)
        time = np.append(time[0] + before * np.mean(np.diff(time)), time)
        given = np.vstack([np.tile(at_rest, (_ROWS_AT_REST, 1)), given])
        output = np.append(np.full(_ROWS_AT_REST, output[0]), output)
    record = SignalRecord(
        name=table.name,
        time=time,
        inputs=given,
        output=output,
        units_input=tuple(into.si_unit for into in inputs),
        unit_output=out.si_unit,
        holds=tuple("zoh" if still else "foh" for still in held),
        held_out=held_out,
    )
    return UsedTrial(table=table, record=record), note


def _at_rest(table: SignalTable, into: Signal, values: FloatArray) -> float:
    """A held input before the trial: its first value, unless it jumps there from another."""
    rest = float(into.of(table.rest))
    span = float(np.ptp(np.append(values, rest)))
    noise = _SENSOR_NOISE.get(into.si_unit, 0.0)
    return rest if abs(values[0] - rest) > max(_SMALL_JUMP * span, noise) else float(values[0])
