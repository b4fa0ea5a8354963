"""One sampled trial of some inputs and one output, as identification of linear models reads it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.inference.record_checks import increasing_time, uniform_interval, varying_output

HOLDS = ("zoh", "foh")
FEWEST_SAMPLES = 16


@dataclass(frozen=True, eq=False)
class SignalRecord:
    """Uniformly sampled inputs and output of one trial.

    Between samples an input is held (``zoh``: a command that a computer writes) or runs straight
    to the next sample (``foh``: a measured, smooth signal such as a pressure).

    Attributes:
        name: such as the trial's name; distinct within one identification.
        time: shape ``(n,)``, uniform and increasing [s].
        inputs: shape ``(n, k)``; ``(n,)`` of one input may be given [units_input].
        output: shape ``(n,)`` [unit_output].
        units_input: SI unit of each input, shown to the user; one for all may be given.
        unit_output: SI unit of the output, shown to the user.
        holds: ``zoh`` or ``foh`` of each input; one for all may be given.
        held_out: whether it is only simulated: then its inputs may be constant.

    Raises:
        InputError: lengths differ, fewer than 16 samples, non-finite samples, non-uniform time,
            constant inputs or output, or an unknown hold.
    """

    name: str
    time: FloatArray
    inputs: FloatArray
    output: FloatArray
    units_input: tuple[str, ...] = ("-",)
    unit_output: str = "-"
    holds: tuple[str, ...] = ("zoh",)
    held_out: bool = False

    def __post_init__(self) -> None:
        for hold in self.holds:
            if hold not in HOLDS:
                raise InputError(f"record {self.name}: hold {hold!r}; give one of {HOLDS}")
        try:
            time, output = increasing_time(self.time, self.output, FEWEST_SAMPLES)
            columns = np.atleast_2d(np.asarray(self.inputs, np.float64).T)
            given = [increasing_time(self.time, column, FEWEST_SAMPLES)[1] for column in columns]
            uniform_interval(time)
            varying_output(output)
        except InputError as error:
            raise InputError(f"record {self.name}: {error}") from None
        if not self.held_out and all(map(_constant, given)):
            raise InputError(
                f"record {self.name}: the input is constant ({given[0][0]:g}); nothing can be "
                "identified without excitation, give a trial in which it changes"
            )
        inputs = np.column_stack(given)
        for field, values in (("time", time), ("inputs", inputs), ("output", output)):
            object.__setattr__(self, field, values)
        for field, values in (("units_input", self.units_input), ("holds", self.holds)):
            object.__setattr__(self, field, _one_each(self.name, field, values, len(given)))

    @property
    def input(self) -> FloatArray:
        """The only input, shape ``(n,)``."""
        if self.inputs.shape[1] > 1:
            raise InputError(
                f"record {self.name} has {self.inputs.shape[1]} inputs where one is expected; take"
                " one of them"
            )
        return self.inputs[:, 0]

    def part(self, rows: slice, **changes: Any) -> SignalRecord:
        """Return some of its samples, which follow each other, as a record with other changes."""
        time, inputs, output = self.time[rows], self.inputs[rows], self.output[rows]
        return replace(self, time=time, inputs=inputs, output=output, **changes)

    @cached_property
    def sample_time(self) -> float:
        """Mean time between samples [s]."""
        return uniform_interval(self.time)

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return float(self.time[-1] - self.time[0])


def _constant(values: FloatArray) -> bool:
    return float(np.ptp(values)) <= 1e-12 * float(np.max(np.abs(values)))


def _one_each(name: str, field: str, values: tuple[str, ...], count: int) -> tuple[str, ...]:
    if len(values) not in (1, count):
        raise InputError(
            f"record {name}: `{field}` has {len(values)} entries for {count} inputs; give one each"
        )
    return values if len(values) == count else values * count


def checked_records(records: Sequence[SignalRecord]) -> tuple[SignalRecord, ...]:
    """Return the records of one identification: at least one, names distinct, units equal."""
    result = tuple(records)
    if not result:
        raise InputError("no records given; give at least one trial")
    names = [record.name for record in result]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(f"record name {twice[0]!r} is given twice; rename one of them")
    first = result[0]
    for record in result[1:]:
        if len(record.units_input) != len(first.units_input):
            raise InputError(
                f"record {record.name} has {len(record.units_input)} inputs but {first.name}"
                f" {len(first.units_input)}; give the same ones"
            )
        if (record.units_input, record.unit_output) != (first.units_input, first.unit_output):
            units, first_units = (", ".join(r.units_input) for r in (record, first))
            raise InputError(
                f"record {record.name} is in {record.unit_output} per {units} but "
                f"{first.name} in {first.unit_output} per {first_units}; convert one of them"
            )
    return result


def time_range(records: Sequence[SignalRecord]) -> tuple[float, float]:
    """Return the shortest sample time and the longest duration [s]."""
    return min(r.sample_time for r in records), max(r.duration for r in records)
