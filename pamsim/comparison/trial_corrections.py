"""Mistakes that a recording may have, in units, signs and columns, and trials without them.

A mistake is known by what undoes it: numbers in mbar, read as kPa, must be multiplied by 0.1.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pamsim.core.units import PA_PER_KPA, FloatArray
from pamsim.physics.air import ATMOSPHERE
from pamsim.recordings.signals import KINDS, column_of, command_columns, kind_of
from pamsim.recordings.trial import Trial

_UNITS: Mapping[str, tuple[tuple[str, float], ...]] = {
    "angle": (("rad", 57.29578), ("turns", 360.0)),
    "position": (("m", 1000.0), ("cm", 10.0), ("in", 25.4)),
    "pressure": (
        ("mbar", 0.1),
        ("mmHg", 0.1333224),
        ("psi", 6.894757),
        ("bar", 100.0),
        ("MPa", 1000.0),
        ("Pa", 0.001),
    ),
    "force": (
        ("kN", 1000.0),
        ("kgf", 9.80665),
        ("lbf", 4.448222),
        ("gf", 0.00980665),
        ("mN", 0.001),
    ),
    "torque": (("N*mm", 0.001), ("N*cm", 0.01)),
}
"""Kind of a quantity -> units that its numbers may be in, and how many of its own each is."""

_CLOCKS = (("minutes", 60.0), ("milliseconds", 0.001))
_WHOLE = 1e-6  # to which written times are a whole number of ticks


@dataclass(frozen=True, kw_only=True)
class Correction:
    """What undoes a mistake."""

    text: str  # the mistake and what to do, to follow the name of the trials
    # Column -> factor and offset that its numbers [SI] take
    changed: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    # Column -> the column whose numbers it takes instead of its own, where a trial has it
    taken: Mapping[str, str] = field(default_factory=dict)
    clock: float = 1.0  # factor of the time

    def applied(self, trial: Trial) -> Trial:
        """A trial as it would be read without the mistake."""
        columns = command_columns(trial.drives, trial.muscle_names)
        lead = trial.lead_in
        if lead is not None:
            starts = map(column_of, trial.pressure_channels)
            start = dict(zip(starts, lead.start_pressure, strict=True))
            lead = replace(
                lead,
                time=lead.time * self.clock,
                duration=lead.duration * self.clock,
                command=self._command(columns, lead.command),
                start_pressure=np.array([self._corrected(column, start) for column in start]),
                measured=self._measured(lead.measured),
            )
        return replace(
            trial,
            time=trial.time * self.clock,
            command=self._command(columns, trial.command),
            measured=self._measured(trial.measured),
            lead_in=lead,
        )

    def reads(self, trial: Trial) -> list[str]:
        """Channels that it changes; none if it changes the clock or what drives a trial, too."""
        columns = self.changed.keys() | self.taken.keys()
        driving = command_columns(trial.drives, trial.muscle_names)
        if self.clock != 1.0 or columns & set(driving):
            return []
        return [channel for channel in trial.measured if column_of(channel) in columns]

    def _command(self, columns: Sequence[str], values: FloatArray) -> FloatArray:
        own = dict(zip(columns, values.T, strict=True))
        return np.column_stack([self._corrected(column, own) for column in columns])

    def _measured(self, measured: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        of_channel = {channel: column_of(channel) for channel in measured}
        read = {column: measured[channel] for channel, column in of_channel.items()}
        return {channel: self._corrected(c, read) for channel, c in of_channel.items()}

    def _corrected(self, column: str, values: Mapping[str, FloatArray]) -> FloatArray:
        factor, offset = self.changed.get(column, (1.0, 0.0))
        source = self.taken.get(column, column)
        return factor * values[source if source in values else column] + offset


def corrections(trial: Trial, missed: Collection[str]) -> Iterator[Correction]:
    """Corrections of all mistakes that a recording, one of whose trials is given, may have.

    Mistakes of some columns of a kind are sought among the channels that the simulation misses.
    """
    for clock, factor in _CLOCKS:
        text = f"time_s looks like {clock}: multiply it by {factor:g}"
        if _samples_wholly(trial.time * factor) or not _samples_wholly(trial.time):
            yield Correction(text=text, clock=factor)
    yield from _of_pressures(trial, missed)
    for kind in ("angle", "position", "force", "torque"):
        yield from _of_readings(kind, trial, missed)
    yield from _swapped_muscles(trial, missed)
    valves = _commands(trial, "valve", "pulse")
    if valves:
        yield _turned(valves)


def _samples_wholly(time: FloatArray) -> bool:
    """Whether a clock (n,) [s] ticks a whole number of times a second, or of seconds a tick.

    Loggers do: a log that does and would not with another unit of time is in its own.
    """
    rate = (time.size - 1) / float(time[-1] - time[0])
    return any(abs(n - round(n)) <= _WHOLE * n for n in (rate, 1.0 / rate))


def _of_pressures(trial: Trial, missed: Collection[str]) -> Iterator[Correction]:
    """Units of the measured pressures, of the set points, of both, or of some measured ones.

    Where no pressure is missed, what is read and what is set agree: only both can be wrong.
    """
    channels = trial.pressure_channels
    driving = command_columns(trial.drives, trial.muscle_names)
    known = [c for c in channels if c in trial.measured or column_of(c) in driving]
    read, sets = tuple(map(column_of, known)), _commands(trial, "pressure_set")
    groups = {(*read, *sets): "all pressures"}
    if any(c in missed for c in channels):
        some = tuple(column_of(c) for c in known if c in missed)
        groups |= {some: "measured pressures", sets: "the set points"}
    if not sets or read in groups:
        groups[read] = "the measured pressures"
    for columns, name in groups.items():
        if columns:
            whose = f"{name} ({', '.join(columns)})"
            yield from _units("pressure", f"{whose} look", columns)
            yield Correction(
                text=f"{whose} look absolute: subtract {ATMOSPHERE / PA_PER_KPA:g} kPa",
                changed=dict.fromkeys(columns, (1.0, -ATMOSPHERE)),
            )


def _of_readings(kind: str, trial: Trial, missed: Collection[str]) -> Iterator[Correction]:
    """Mistakes in readings of one kind that drive nothing: in all of them, or in those missed."""
    driving = command_columns(trial.drives, trial.muscle_names)
    every = [c for c in trial.measured if kind_of(c) == kind and column_of(c) not in driving]
    some = [column_of(c) for c in every if c in missed]
    if not some:
        return
    groups = dict.fromkeys([tuple(map(column_of, every)), tuple(some)])
    for columns in groups:
        look = "looks" if len(columns) == 1 else "look"
        yield from _units(kind, f"{', '.join(columns)} {look}", columns)
    for columns in dict.fromkeys([*groups, *((column,) for column in some)]):
        yield _turned(columns)
    for first, second in itertools.combinations(some, 2):
        yield _swap([(first, second)])


def _swapped_muscles(trial: Trial, missed: Collection[str]) -> Iterator[Correction]:
    """Two muscles under each other's names, in what is read of them, or commanded, or both.

    Where a simulated pressure is missed, what is read and what is commanded are of two muscles;
    where none is, both are of the other. Muscles that are driven in different ways have columns of
    different quantities, which cannot be exchanged.
    """
    pressures = trial.pressure_channels
    columns, kinds = command_columns(trial.drives, trial.muscle_names), trial.drives.muscles
    wrong = [i for i, channel in enumerate(pressures) if channel in missed]
    for one, two in itertools.combinations(wrong or range(trial.muscles), 2):
        if kinds[one] != kinds[two]:
            continue
        command, read = (columns[one], columns[two]), (pressures[one], pressures[two])
        commanded = [command] if all(command) else []
        known = set(read) <= trial.measured.keys()
        measured = [(column_of(read[0]), column_of(read[1]))] if known else []
        if wrong and measured and commanded and measured != commanded:
            yield _swap(measured)
            yield _swap(commanded)
        else:
            yield _swap([*dict.fromkeys([*commanded, *measured])])


def _units(kind: str, look: str, columns: Collection[str]) -> Iterator[Correction]:
    for unit, factor in _UNITS[kind]:
        yield Correction(
            text=f"{look} like {unit} taken for {KINDS[kind].shown}: multiply by {factor:g}",
            changed=dict.fromkeys(columns, (factor, 0.0)),
        )


def _turned(columns: Sequence[str]) -> Correction:
    return Correction(
        text=f"the sign of {', '.join(columns)} looks turned: multiply by -1",
        changed=dict.fromkeys(columns, (-1.0, 0.0)),
    )


def _swap(pairs: Sequence[tuple[str, str]]) -> Correction:
    names = ", and ".join(f"{one} and {two}" for one, two in pairs)
    taken = {a: b for one, two in pairs for a, b in ((one, two), (two, one))}
    return Correction(text=f"{names} look swapped: exchange them", taken=taken)


def _commands(trial: Trial, *kinds: str) -> tuple[str, ...]:
    """Columns of commands of some kinds of drive."""
    columns = command_columns(trial.drives, trial.muscle_names)
    return tuple(c for c, kind in zip(columns, trial.drives.kinds, strict=True) if kind in kinds)
