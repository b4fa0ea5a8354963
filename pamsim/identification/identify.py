"""Identify linear models from a recording: fit several, compare them, recommend one."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence

from pamsim.core.errors import InputError
from pamsim.core.trial import TrialSet
from pamsim.identification.choice import recommend
from pamsim.identification.data import chosen, load_data
from pamsim.identification.local import local_map
from pamsim.identification.models import Choice, Progress, fit_models
from pamsim.identification.result import Identification
from pamsim.identification.signals import (
    Signal,
    SignalTable,
    default_input,
    default_output,
    record_of,
    signal,
)
from pamsim.linear.signal_record import SignalRecord

Pair = tuple[SignalTable, SignalRecord]


def identify(
    data: str | os.PathLike[str] | TrialSet,
    *,
    input: str | None = None,
    output: str | None = None,
    choice: Choice | None = None,
    trials: Sequence[str] = (),
    protocols: Sequence[str] = (),
    hold_out: Sequence[str] = (),
    local: bool = True,
    progress: Progress | None = None,
) -> Identification:
    """Fit continuous, ARX and output-error models to one input and one output.

    Args:
        data: folder of a recording, a CSV with ``time_s`` and any columns, or trials.
        input: columns joined by + and -; the set pressure difference, else the valves', if left
            out.
        output: likewise; ``angle_deg`` if left out.
        choice: which models; first and second order with and without dead time if left out.
        trials: names to use; all if empty.
        protocols: protocols to use; all if empty.
        hold_out: names to keep from the fit and to judge the models by.
        local: whether to fit the recommended structure again at every operating point.
        progress: told ``(done, total, what)``.

    Returns:
        All models, the recommended one named with the reason.

    Raises:
        InputError: for data that cannot be read or identified from, or an unknown name.
    """
    began = time.perf_counter()
    loaded = load_data(data)
    used, kept = chosen(loaded, trials, protocols, hold_out)
    tables = [*used, *kept]
    given = signal(input or default_input(tables), tables)
    out = signal(output or default_output(tables), tables)
    if {name for _, name in given.terms} & {name for _, name in out.terms}:
        raise InputError(f"input {given.text!r} and output {out.text!r} share a column")
    notes = list(loaded.notes)
    fitting = _records(used, given, out, notes)
    testing = _records(kept, given, out, notes) if kept else ()
    fitted = fit_models(
        [record for _, record in fitting],
        [record for _, record in testing],
        choice or Choice(),
        progress,
    )
    found = recommend(
        fitted.candidates,
        [record for _, record in fitting],
        [record for _, record in testing],
    )
    best = next((c.fit for c in fitted.candidates if c.name == found.name), None)
    points, said = local_map(fitting, best, progress) if local and best is not None else (None, ())
    return Identification(
        data=loaded,
        given=given,
        output=out,
        used=fitting,
        held_out=testing,
        fitted=fitted,
        recommendation=found,
        local=points,
        notes=(*notes, *said),
        seconds=time.perf_counter() - began,
    )


def _records(
    tables: Sequence[SignalTable], given: Signal, out: Signal, notes: list[str]
) -> tuple[Pair, ...]:
    """Records of the trials that have something to identify; what the others lack is noted."""
    pairs: list[Pair] = []
    refused: list[InputError] = []
    for table in tables:
        try:
            record, note = record_of(table, given, out)
        except InputError as error:
            refused.append(error)
            notes.append(f"left out: {error}")
            continue
        pairs.append((table, record))
        notes += [note] if note else []
    if not pairs:
        raise refused[0]
    return tuple(pairs)
