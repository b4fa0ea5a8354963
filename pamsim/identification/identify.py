"""Identify linear models from recordings: fit several, compare them, recommend one."""

from __future__ import annotations

import os
from collections.abc import Sequence
from time import perf_counter

import numpy as np

from pamsim.core.computation import Progress, one_blas_thread
from pamsim.core.errors import InputError
from pamsim.identification.data import read_data, select_trials, trials_of
from pamsim.identification.frequency import FrequencyIdentification, identify_frequency_response
from pamsim.identification.frequency_table import is_over_frequency
from pamsim.identification.local_models import fit_operating_points
from pamsim.identification.models import ModelSet, fit_models
from pamsim.identification.records import SignalRecord
from pamsim.identification.result import Identification
from pamsim.identification.signals import (
    Signal,
    SignalTable,
    UsedTrial,
    chosen_signals,
    signal,
    used_trial,
)
from pamsim.recordings.columns import Columns
from pamsim.recordings.trial import TrialSet

_SAME = 1e-9  # of an input's size, below which a difference is rounding


@one_blas_thread()
def identify(
    data: str | os.PathLike[str] | TrialSet | Sequence[str | os.PathLike[str]],
    *,
    input: str | Sequence[str] | None = None,
    output: str | None = None,
    time: str | None = None,
    dt: float | None = None,
    hold: str | None = None,
    order: int | None = None,
    zeros: int = 0,
    poles: str = "auto",
    dead_time: str = "auto",
    arx: tuple[int, int, int] | None = None,
    oe: tuple[int, int, int] | None = None,
    start: str = "auto",
    integrators: int = 0,
    trials: str | Sequence[str] = (),
    protocols: str | Sequence[str] = (),
    hold_out: str | Sequence[str] | float = (),
    local: bool = True,
    progress: Progress | None = None,
) -> Identification | FrequencyIdentification:
    """Fit continuous models to inputs and one output; ARX and output error to a single input.

    Args:
        data: folder of a recording, a table of any columns, trials, or several paths, whose
            trials are fitted together. Or a table over frequency, of magnitude and phase, or real
            and imaginary part, to which continuous models are fitted: see
            `pamsim.identification.frequency.identify_frequency_response`.
        input: a column, or columns joined by + and -; several as a list; if left out, the set
            pressure difference, else the valves', else the first of two columns.
        output: one likewise; if left out, ``angle_deg``, the only joint, or the second column.
        time: column of a table's clock; ``time_s`` or the only one called like a clock if left
            out.
        dt: time between two rows of a table without a clock [s].
        hold: of a table's columns from row to row: ``zoh`` (held) or ``foh`` (straight); guessed if
            left out.
        order: poles of the continuous model, 0 to 6, integrators not counted; if left out, a scan
            chooses poles, zeros, integrators and dead time.
        zeros: of the model of that order.
        poles: ``real`` lags, ``any`` stable poles, or ``auto``: any beside real where two lags
            merge.
        dead_time: ``none``, ``free`` (estimated), or ``auto`` for both.
        arx: (na, nb, nk) of the ARX model; two small ones if left out.
        oe: (nb, nf, nk) of the output-error model; two small ones if left out.
        start: of every trial: at ``rest``, in a ``free`` state that is fitted, or ``auto``: rest
            for recordings of a rig, which begin at rest; free for tables and parts of a trial.
        integrators: poles at 0 of the model of that order.
        trials: names to use; all if empty.
        protocols: protocols to use; all if empty.
        hold_out: names of trials to exclude from the fit and to judge the models by, or the share
            of every trial's end, such as 0.3.
        local: whether to fit the recommended structure again at every operating point.
        progress: called with ``(done, total, what)``.

    Returns:
        All models, the recommended one named with the reason.

    Raises:
        InputError: for data that cannot be read or identified from, or an unknown name.
    """
    began = perf_counter()
    read = read_data(data)
    table = read[0][1] if len(read) == 1 else None
    if isinstance(table, Columns) and is_over_frequency(table):
        of_trials = {
            "input": input, "output": output, "time": time, "dt": dt, "hold": hold, "arx": arx,
            "oe": oe, "start": start if start != "auto" else None, "integrators": integrators,
            "trials": trials, "protocols": protocols, "hold_out": hold_out,
        }  # fmt: skip
        for argument, value in of_trials.items():
            if value:
                raise InputError(
                    f"`{argument}` is for trials; {table.path} is a frequency response, omit it"
                )
        return identify_frequency_response(
            table, order=order, zeros=zeros, poles=poles, dead_time=dead_time, progress=progress
        )
    loaded = trials_of(read, time=time, dt=dt, hold=hold)
    to_fit, to_test = select_trials(loaded, trials, protocols, hold_out)
    tables = [*to_fit, *to_test]
    given = [input] if isinstance(input, str) else [*(input or ())]
    given, output, assumed = chosen_signals(tables, given, output)
    inputs, out = tuple(signal(text, tables) for text in given), signal(output, tables)
    for into in inputs:
        if {name for _, name in into.terms} & {name for _, name in out.terms}:
            raise InputError(f"input {into.text!r} and output {out.text!r} share a column")
    notes = [*loaded.notes, *([assumed] if assumed else [])]
    used = _used_trials(to_fit, inputs, out, notes)
    held_out = _used_trials(to_test, inputs, out, notes) if to_test else ()
    records = [trial.record for trial in used]
    _require_independent(records, inputs)
    parts = [table.name for table in tables if table.moving]
    if parts and start == "rest":
        raise InputError(
            f"`start` rest: {parts[0]} is a part of a longer trial and begins in any state; omit"
            " `start`, or hold out whole trials"
        )
    if start == "auto":
        start = "rest" if loaded.rig and not parts else "free"
    models = ModelSet(
        order=order,
        zeros=zeros,
        poles=poles,
        dead_time=dead_time,
        arx=arx,
        oe=oe,
        start=start,
        integrators=integrators,
    )
    found = fit_models(records, [trial.record for trial in held_out], models, progress)
    recommendation = found.recommended()
    local_map = None
    if local and recommendation.best and len(inputs) == 1:
        best = found.fitted[recommendation.best].fit
        local_map, local_notes = fit_operating_points(used, best, progress)
        notes += local_notes
    return Identification(
        data=loaded,
        inputs=inputs,
        output=out,
        used=used,
        held_out=held_out,
        candidates=found.candidates,
        skipped=found.skipped,
        choice=found.choice,
        recommendation=recommendation,
        local=local_map,
        notes=tuple(notes),
        seconds=perf_counter() - began,
    )


def _used_trials(
    tables: Sequence[SignalTable], inputs: Sequence[Signal], out: Signal, notes: list[str]
) -> tuple[UsedTrial, ...]:
    """The trials that can be identified from; why others cannot is noted."""
    used: list[UsedTrial] = []
    refusals: list[InputError] = []
    for table in tables:
        try:
            trial, note = used_trial(table, inputs, out)
        except InputError as error:
            refusals.append(error)
            notes.append(f"not used: {error}")
            continue
        used.append(trial)
        notes += [note] if note else []
    if not used:
        raise refusals[0]
    return tuple(used)


def _require_independent(records: Sequence[SignalRecord], inputs: Sequence[Signal]) -> None:
    """Refuse inputs of which one never changes, or does not change by itself."""
    changes = np.concatenate([record.inputs - np.mean(record.inputs, axis=0) for record in records])
    known = np.empty((changes.shape[0], 0))
    for place, into in enumerate(inputs):
        column = changes[:, place]
        left = column - known @ (known.T @ column)
        largest = max(float(np.max(np.abs(record.inputs[:, place]))) for record in records)
        if np.max(np.abs(column)) <= _SAME * largest:
            raise InputError(f"input {into.text!r} never changes within a trial; omit it")
        if np.linalg.norm(left) <= _SAME * np.linalg.norm(column):
            raise InputError(
                f"input {into.text!r} follows from {', '.join(i.text for i in inputs[:place])}:"
                " their effects cannot be distinguished; omit one of them"
            )
        known = np.column_stack([known, left / np.linalg.norm(left)])
