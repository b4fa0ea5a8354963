"""Parts of long records, with which searches begin that end with the whole.

What takes time in a search are the evaluations on the way; of a million samples a twentieth leads
it next to the same place.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.identification.records import SignalRecord

_ROWS = 50_000
"""Samples of the first part: enough for every effect of more than a thousandth of the noise's
variance, and searched in seconds."""
_MORE = 4  # times as many in the next: all parts together cost a third of the whole at most
_MOVES = 0.5
"""Spread of a signal in a part, over that in the whole, from which the part is like it: at half the
signal the ratio to the noise is still a quarter of the whole's."""
_SHOWN = 0.1  # slowest time constant over the length of a trial, in which it decays to 5e-5


def growing_parts(records: Sequence[SignalRecord]) -> Iterator[Sequence[SignalRecord]]:
    """Ever larger parts of records in which all signals move as much, and in the end all of them.

    A part has fewer trials, evenly drawn; if one is too long already, its beginning.
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
