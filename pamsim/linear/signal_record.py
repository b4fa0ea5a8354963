"""One sampled trial of one input and one output, as identification of linear models reads it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.inference.record_checks import increasing_time, uniform_interval, varying_output

FloatArray = NDArray[np.float64]

HOLDS = ("zoh", "foh")
FEWEST_SAMPLES = 16


@dataclass(frozen=True, eq=False)
class SignalRecord:
    """Uniformly sampled input and output of one trial.

    Between samples the input is held (``zoh``: a command that a computer writes) or runs straight
    to the next sample (``foh``: a measured, smooth signal such as a pressure).

    Attributes:
        name: such as the trial's name; distinct within one identification.
        time: shape ``(n,)``, uniform and increasing [s].
        input: shape ``(n,)`` [unit_input].
        output: shape ``(n,)`` [unit_output].
        unit_input: SI unit of the input, shown to the user.
        unit_output: SI unit of the output, shown to the user.
        hold: ``zoh`` or ``foh``.
        held_out: whether it is only simulated: then its input may be constant.

    Raises:
        InputError: lengths differ, fewer than 16 samples, non-finite samples, non-uniform time,
            a constant input or output, or an unknown hold.
    """

    name: str
    time: FloatArray
    input: FloatArray
    output: FloatArray
    unit_input: str = "-"
    unit_output: str = "-"
    hold: str = "zoh"
    held_out: bool = False

    def __post_init__(self) -> None:
        if self.hold not in HOLDS:
            raise InputError(f"record {self.name}: hold {self.hold!r}; give one of {HOLDS}")
        try:
            time, output = increasing_time(self.time, self.output, FEWEST_SAMPLES)
            _, given = increasing_time(self.time, self.input, FEWEST_SAMPLES)
            uniform_interval(time)
            varying_output(output)
        except InputError as error:
            raise InputError(f"record {self.name}: {error}") from None
        if not self.held_out and float(np.ptp(given)) <= 1e-12 * float(np.max(np.abs(given))):
            raise InputError(
                f"record {self.name}: the input is constant ({given[0]:g}); nothing can be "
                "identified without excitation, give a trial in which it changes"
            )
        for field, values in (("time", time), ("input", given), ("output", output)):
            object.__setattr__(self, field, values)

    def part(self, rows: slice, *, held_out: bool = False) -> SignalRecord:
        """Return some of its samples, which follow each other, as a record of the same name."""
        return replace(
            self,
            time=self.time[rows],
            input=self.input[rows],
            output=self.output[rows],
            held_out=held_out,
        )

    @cached_property
    def sample_time(self) -> float:
        """Mean time between samples [s]."""
        return uniform_interval(self.time)

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return float(self.time[-1] - self.time[0])


def checked_records(records: Sequence[SignalRecord]) -> tuple[SignalRecord, ...]:
    """Return the records of one identification: at least one, names distinct, units equal.

    Args:
        records: the trials.

    Returns:
        The same as a tuple.

    Raises:
        InputError: none given, a name twice, or units that differ.
    """
    result = tuple(records)
    if not result:
        raise InputError("no records given; give at least one trial")
    names = [record.name for record in result]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(f"record name {twice[0]!r} is given twice; rename one of them")
    first = result[0]
    for record in result[1:]:
        if (record.unit_input, record.unit_output) != (first.unit_input, first.unit_output):
            raise InputError(
                f"record {record.name} is in {record.unit_output} per {record.unit_input} but "
                f"{first.name} in {first.unit_output} per {first.unit_input}; convert one of them"
            )
    return result
