"""One long log as several trials, and on an even clock, as its entry in ``recording.toml`` says.

    period = "9.93 s"                  # or segments = [[12.0, 22.0], [31.5, 41.5]]
    lead_in = "2 s"                    # simulated before each, not compared
    rate = "50 Hz"

Times count from the log's first row. Periods are repeats of each other; so are segments, but for
those whose commands are held at other levels: they are inputs of their own, ``protocol_2`` and so
on. A log whose clock is not even is simulated at 2000 Hz so that no command is late; on an even
clock that divides 2000 Hz, a simulation takes as few samples as the log has.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, cast

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.toml_tables import NUMBER, Entry
from pamsim.core.units import FloatArray, parse_quantity
from pamsim.recordings.recording_checks import FEWEST_ROWS
from pamsim.recordings.trial import HELD_OUT_SUFFIX, Trial, TrialLead


def _are_pairs(spans: list[Any]) -> bool:
    each = [isinstance(span, list) and len(cast("list[Any]", span)) == 2 for span in spans]
    return bool(each) and all(each)


_TIME = Entry(str | NUMBER, 'a time such as "2 s"', None)
ENTRIES = {
    "period": _TIME,
    "segments": Entry(list, "pairs of times in s, [[12.0, 22.0], [31.5, 41.5]]", None, _are_pairs),
    "lead_in": _TIME,
    "rate": Entry(str, 'a rate such as "50 Hz"', None),
}
"""Of a trial's table in ``recording.toml``."""

_LEAD_IN = 2.0  # before a segment, if nothing is stated [s]: valves, friction and hysteresis
# forget within it, the slow creep of fluidic muscles does not
_ROUNDING = 1e-6  # of times written by hand [s]
_CLOCK_ROUNDING = 1e-9  # of a time that is a whole number of samples [s]
_BRIEF = 3  # rows at one level that may be the end of the level before


def trials_of(trial: Trial, entry: Mapping[str, Any], where: str) -> tuple[Trial, ...]:
    """Put a log on the clock, and cut it into the trials, that its table says.

    The table's ``entry`` has all of `ENTRIES`, None where nothing is stated. Several trials are
    numbered; the log itself is the only one if its table names none.

    Raises:
        InputError: for a time without meaning, a segment outside the log or of too few rows, a rate
            above the log's own.
    """
    period, segments, lead_in, rate = (entry[key] for key in ENTRIES)
    if rate is not None:
        trial = _on_even_clock(trial, rate, where)
    if period is not None and segments:
        raise InputError(f"{where}: give period or segments, not both")
    if period is None and segments is None and lead_in is None:
        return (trial,)
    lead = _seconds(_LEAD_IN if lead_in is None else lead_in, f"{where}: lead_in")
    spans = [(lead, math.inf)]
    if period is not None:
        length, end = _seconds(period, f"{where}: period"), float(trial.time[-1])
        room = end + trial.sample_interval - lead  # the last row lasts as long as the others
        count = math.floor((room + _ROUNDING) / length) if length > 0.0 else 0
        if count < 1:
            raise InputError(
                f"{where}: no period of {length:g} s fits into {end:g} s after a lead-in of"
                f" {lead:g} s"
            )
        if count * FEWEST_ROWS > trial.time.size:
            raise InputError(
                f"{where}: of periods of {length:g} s, some have fewer than the {FEWEST_ROWS} rows"
                " that a trial needs; give a longer period"
            )
        spans = [(lead + k * length, lead + (k + 1) * length) for k in range(count)]
    elif segments:
        spans = spans_of(segments, f"{where}: segments")
    trials = [_part(trial, span, lead, where) for span in spans]
    if len(trials) == 1:
        return (trials[0],)
    if segments:
        trials = _inputs_apart(trials)
    return tuple(replace(t, name=f"{trial.name}_{k}") for k, t in enumerate(trials, start=1))


def spans_of(pairs: list[Any], where: str) -> list[tuple[float, float]]:
    """Begin and end of each segment [s]; InputError for a time without meaning or no span."""
    spans = [(_seconds(begin, where), _seconds(end, where)) for begin, end in pairs]
    for begin, end in spans:
        if begin >= end:
            raise InputError(
                f"{where}: a segment from {begin:g} to {end:g} s; write the earlier time first"
            )
    return spans


def _on_even_clock(trial: Trial, rate: str, where: str) -> Trial:
    """A trial sampled evenly, at a rate such as ``"50 Hz"``, from its first row on.

    What was measured is taken on the line between two rows, a command that is held from the nearest
    row: which of two rows a step lies nearer to is all that the log shows.
    """
    hertz = parse_quantity(rate, "Hz", "Hz", where=f"{where}: rate")
    own = (trial.time.size - 1) / float(trial.time[-1])
    if not (math.isfinite(hertz) and 0.0 < hertz <= 1.001 * own):
        raise InputError(
            f"{where}: rate = {rate!r} must be above 0 and at most {own:.4g} Hz, the log's own"
        )
    time = np.arange(math.floor(trial.time[-1] * hertz + _CLOCK_ROUNDING) + 1) / hertz
    if time.size < FEWEST_ROWS:
        raise InputError(
            f"{where}: rate = {rate!r} leaves {time.size} rows of a log of {trial.time[-1]:g} s;"
            f" a trial needs {FEWEST_ROWS} or more"
        )

    def between(values: FloatArray) -> FloatArray:
        return np.interp(time, trial.time, values)

    nearest = np.round(between(np.arange(trial.time.size, dtype=float))).astype(int)
    command = trial.command[nearest]
    for column in np.flatnonzero(trial.drives.between):
        command[:, column] = between(trial.command[:, column])
    measured = {channel: between(values) for channel, values in trial.measured.items()}
    return replace(trial, time=time, command=command, measured=measured)


def _part(trial: Trial, span: tuple[float, float], lead: float, where: str) -> Trial:
    (begin, end), time = span, trial.time
    last = float(time[-1])
    asked = f"{where}: {begin:g} to {end:g} s"
    if begin > last or last + trial.sample_interval + _ROUNDING < end < math.inf:
        raise InputError(f"{asked} is not in the log, which ends at {last:g} s")
    at, first, stop = np.searchsorted(time, np.array([begin - lead, begin, end]) - _ROUNDING)
    if stop - first < FEWEST_ROWS:
        raise InputError(f"{asked} has {stop - first} rows; a trial needs {FEWEST_ROWS} or more")
    lead_in = None
    if at < first:
        pressures = [trial.measured.get(channel) for channel in trial.pressure_channels]
        start = [math.nan if values is None else values[at] for values in pressures]
        before = trial.rows(slice(at, first))
        lead_in = TrialLead(
            time=before.time,
            duration=float(time[first] - time[at]),
            command=before.command,
            start_pressure=np.array(start),
            measured=before.measured,
        )
    return replace(trial.rows(slice(first, stop)), lead_in=lead_in)


def _inputs_apart(trials: list[Trial]) -> list[Trial]:
    """Trials with a protocol of their own for each input, where there are several.

    An input is the levels at which commands are held, one after the other, but for brief ones.
    """
    levels: list[tuple[tuple[float, ...], ...]] = []
    for trial in trials:
        held = trial.command[:, np.logical_not(trial.drives.between)]
        changes = np.flatnonzero(np.any(np.diff(held, axis=0) != 0.0, axis=1)) + 1
        edges = np.concatenate([[0], changes, [len(held)]])
        longer = edges[:-1][np.diff(edges) > _BRIEF]
        levels.append(tuple(map(tuple, held[longer].tolist())))
    inputs = list(dict.fromkeys(levels))
    if len(inputs) == 1:
        return trials
    stem = trials[0].protocol.removesuffix(HELD_OUT_SUFFIX)
    end = trials[0].protocol.removeprefix(stem)
    return [
        replace(trial, protocol=f"{stem}_{inputs.index(own) + 1}{end}")
        for trial, own in zip(trials, levels, strict=True)
    ]


def _seconds(value: object, where: str) -> float:
    seconds = parse_quantity(str(value), "s", "s", where=where)
    if not 0.0 <= seconds < math.inf:
        raise InputError(f"{where} = {value!r} is no time; write 0 s or more")
    return seconds
