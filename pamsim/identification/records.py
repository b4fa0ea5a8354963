"""What a linear model is fitted to: sampled trials, or a frequency response.

How well a run of a model fits a trial, and the parts of long trials that a search begins with.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.inference.record_checks import (
    finite_samples,
    increasing_time,
    uniform_interval,
    usual_size,
    varying_output,
)

HOLDS = ("zoh", "foh")
FEWEST_SAMPLES = 16  # of a trial, for three unknowns and more
FEWEST_FREQUENCIES = 8  # the same: each has two parts
_APART = 1.0  # rad at the highest frequency, between dead times to start from
_MOST_DELAYS = 20  # each is a search of its own
_LAGS = 40  # at which a delayed input is compared
_ANOTHER, _THE_SAME = 0.25, 0.8  # share explained of a signal that is another one, or the same
_ROWS = 50_000
"""Samples of the first part: enough for every effect of more than a thousandth of the noise's
variance, and searched in seconds."""
_MORE = 4  # times as many in the next: all parts together cost a third of the whole at most
_MOVES = 0.5
"""Spread of a signal in a part, over that in the whole, from which the part is like it: at half the
signal the ratio to the noise is still a quarter of the whole's."""
_SHOWN = 0.1  # slowest time constant over the length of a trial, in which it decays to 5e-5


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
            for column in given:
                usual_size(column, "input")
        except InputError as error:
            raise InputError(f"record {self.name}: {error}") from None
        still = (np.ptp(column) <= 1e-12 * np.max(np.abs(column)) for column in given)
        if not self.held_out and all(still):
            raise InputError(
                f"record {self.name}: the input is constant ({given[0][0]:g}); nothing can be "
                "identified without excitation, give a trial in which it changes"
            )
        inputs = np.column_stack(given)
        for field, values in (("time", time), ("inputs", inputs), ("output", output)):
            object.__setattr__(self, field, values)
        for field in ("units_input", "holds"):
            values, count = getattr(self, field), len(given)
            if len(values) not in (1, count):
                raise InputError(
                    f"record {self.name}: `{field}` has {len(values)} entries for {count} inputs;"
                    " give one each"
                )
            object.__setattr__(self, field, values if len(values) == count else values * count)

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


@dataclass(frozen=True, eq=False)
class FrequencyRecord:
    """A measured frequency response from one input.

    Raises:
        InputError: lengths differ, fewer than 8 frequencies, one that is not above the one before,
            a response of 0, or samples that are not finite.
    """

    frequency: FloatArray  # rising, shape ``(n,)``, n >= 8 [rad/s]
    response: NDArray[np.complex128]  # complex, never 0, shape ``(n,)`` [output per input]

    def __post_init__(self) -> None:
        w = finite_samples(self.frequency, "frequency")
        g = np.asarray(self.response, np.complex128)
        if g.shape != w.shape:
            raise InputError(f"{w.size} frequencies, but a response of shape {g.shape}")
        if w.size < FEWEST_FREQUENCIES:
            raise InputError(f"{w.size} frequencies are too few; give {FEWEST_FREQUENCIES} or more")
        if w[0] <= 0.0 or np.any(np.diff(w) <= 0.0):
            raise InputError(
                "frequencies must be above 0 and rise; sort them and drop repeated ones"
            )
        if not np.all(np.isfinite(g)) or np.any(g == 0.0):
            raise InputError("the response is 0 or not finite at some frequency; leave that out")
        object.__setattr__(self, "frequency", w)
        object.__setattr__(self, "response", g)

    def dead_times(self, zeros: int) -> FloatArray:
        """Return dead times of a model with some zeros to search from, from 0 to the longest [s].

        They are close enough together for the highest frequency.
        """
        phase = np.unwrap(np.angle(self.response))
        # Each zero may lead by a quarter turn and so hide as much of the delay.
        lag = max(float(phase[0] - phase[-1]), 0.0) + 0.5 * np.pi * (zeros + 1)
        count = min(int(lag / _APART) + 2, _MOST_DELAYS)
        return np.linspace(0.0, lag / float(self.frequency[-1]), count)


Data = Sequence[SignalRecord] | FrequencyRecord
"""What a model is fitted to."""


def inputs_repeat(record: SignalRecord, place: int, delay: float) -> bool:
    """Whether an input, so much later, follows from what the inputs are then.

    As a square wave does half a period later, having been another signal in between.
    """
    samples = round(delay / record.sample_time)
    if not 0 < samples < record.output.size // 2:
        return False
    lags = np.unique(np.linspace(0, samples, _LAGS).astype(int))
    shares = [_explained(record.inputs, place, lag) for lag in lags]
    return min(shares) < _ANOTHER and shares[-1] > _THE_SAME


def _explained(inputs: FloatArray, place: int, lag: int) -> float:
    """Share of the variation of a delayed input that all inputs explain; 0 of a constant one."""
    late, now = inputs[: len(inputs) - lag, place], inputs[lag:]
    late, now = late - np.mean(late), now - np.mean(now, axis=0)
    total = float(late @ late)
    if total == 0.0:
        return 0.0
    left = late - now @ np.linalg.lstsq(now, late, rcond=None)[0]
    return 1.0 - float(left @ left) / total


def fit_percent(measured: ArrayLike, simulated: ArrayLike) -> float:
    """Return the normalised root-mean-square fit ``100 (1 - |y - yhat| / |y - mean(y)|)``.

    100 is a perfect match, 0 is no better than the mean of the data, negative is worse than it.
    A simulation that left the finite numbers (an unstable model) gives minus infinity.

    Source: definition used by MATLAB ``compare`` (System Identification Toolbox, NRMSE fit).
    """
    y = finite_samples(measured, "measured")
    yhat = np.asarray(simulated, dtype=np.float64)
    if y.size == 0 or y.shape != yhat.shape:
        raise InputError(
            f"measured has shape {y.shape}, simulated {yhat.shape}; "
            "give two non-empty series of one length"
        )
    varying_output(y)
    if not np.all(np.isfinite(yhat)):
        return float("-inf")
    # A huge but finite simulation may overflow in the norm: that, too, is minus infinity.
    with np.errstate(over="ignore"):
        miss = float(np.linalg.norm(y - yhat))
    return 100.0 * (1.0 - miss / float(np.linalg.norm(y - np.mean(y))))


def pooled_fit_percent(pairs: Sequence[tuple[FloatArray, FloatArray]]) -> float:
    """Return the fit of (measured, simulated) trials, each about its own mean, together [%]."""
    measured = np.concatenate([y - np.mean(y) for y, _ in pairs])
    simulated = np.concatenate([run - np.mean(y) for y, run in pairs])
    # The joint mean is 0 up to rounding, so that this is the definition of one trial.
    return fit_percent(measured, simulated)


def growing_parts(records: Sequence[SignalRecord]) -> Iterator[Sequence[SignalRecord]]:
    """Ever larger parts of records in which all signals move as much, and in the end all of them.

    A part has fewer trials, evenly drawn; if one is too long already, its beginning. What takes
    time in a search are the evaluations on the way: a twentieth of a million samples leads it next
    to the place where the whole ends it.
    """
    samples, rows = sum(record.output.size for record in records), _ROWS
    while rows < samples:
        part = _part(records, max(1, rows * len(records) // samples), rows)
        if part is not None:
            yield part
        rows *= _MORE
    yield records


def shows(part: Sequence[SignalRecord], slowest: float) -> bool:
    """Whether a part is long enough for a mode that takes so long to decay by e [s]."""
    return slowest <= _SHOWN * min(record.duration for record in part)


def _part(records: Sequence[SignalRecord], count: int, rows: int) -> list[SignalRecord] | None:
    """So many trials of so many samples in all; None where some signal moves less in them."""
    drawn = np.linspace(0, len(records) - 1, count).astype(int).tolist()
    try:
        found = [
            own if own.output.size * count <= rows else own.part(slice(0, rows // count))
            for own in (records[k] for k in drawn)
        ]
    except InputError:  # its input or output never moves
        return None
    return found if np.all(_spread(found) >= _MOVES * _spread(records)) else None


def _spread(records: Sequence[SignalRecord]) -> FloatArray:
    """Standard deviation of the output and of each input, (1 + inputs,)."""
    return np.std(np.concatenate([np.column_stack([r.output, r.inputs]) for r in records]), axis=0)
