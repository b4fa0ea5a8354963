"""Trials cut into parts of time, where too few trials are recorded to hold whole ones out.

Simulations still run through the whole trial; a fit leaves out the residual of the parts that are
held out. Parts are long beside the correlation of usual sensor drift, so that each is one
independent piece of evidence; samples are not.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.inference.residual_block import Blocks
from pamsim.recordings.trial import Trial

SHORTEST = 1.0
"""Shortest part where a trial is long enough [s]: three times a drift's correlation time of 0.3 s
and more."""

FEWEST, MOST = 4, 24
"""Parts of a trial."""


@dataclass(frozen=True, kw_only=True)
class TrialParts:
    """How trials are cut.

    Attributes:
        rows: trial -> name of each part and its samples, in the order of time; without gaps.
        held_out: names of the parts that no fit uses.
    """

    rows: Mapping[str, Mapping[str, slice]]
    held_out: frozenset[str]

    @property
    def origin(self) -> dict[str, str]:
        """Part -> trial."""
        return {name: trial for trial, parts in self.rows.items() for name in parts}

    @property
    def held_out_trials(self) -> tuple[str, ...]:
        """Trials all of whose parts are held out, so that no fit needs their simulation."""
        return tuple(t for t, parts in self.rows.items() if self.held_out.issuperset(parts))

    def blocks(self, blocks: Blocks, *, held_out: bool) -> Blocks:
        """Cut the residuals of one simulation.

        Args:
            blocks: of whole trials.
            held_out: False for the fitted parts alone.
        """
        return [
            replace(block, trial=name, residual=block.residual[rows])
            for block in blocks
            for name, rows in self.rows[block.trial].items()
            if held_out or name not in self.held_out
        ]

    def signals(
        self, signals: Mapping[str, Mapping[str, FloatArray]]
    ) -> dict[str, dict[str, FloatArray]]:
        """Cut signals: trial -> name -> (n,) to part -> name -> its samples."""
        return {
            name: {channel: values[rows] for channel, values in signals[trial].items()}
            for trial, parts in self.rows.items()
            if trial in signals
            for name, rows in parts.items()
        }


def cut_trials(trials: Sequence[Trial], held_out: Iterable[str], alternate: bool) -> TrialParts:
    """Cut trials into parts.

    Args:
        trials: as measured.
        held_out: names of those that are held out whole.
        alternate: whether half of the parts are held out of a trial whose protocol has no trial
            that is held out whole.
    """
    rows: dict[str, dict[str, slice]] = {}
    held: set[str] = set()
    whole = set(held_out)
    judged = {t.protocol for t in trials if t.name in whole}
    for trial in trials:
        parts = _parts(trial)
        rows[trial.name] = parts
        for number, name in enumerate(parts):
            alternates = alternate and trial.protocol not in judged
            if trial.name in whole or (alternates and _second(number)):
                held.add(name)
    return TrialParts(rows=rows, held_out=frozenset(held))


def _parts(trial: Trial) -> dict[str, slice]:
    """Name -> samples of each part; an even number of them, about equally long."""
    count = trial.time.size
    length = count * trial.sample_interval
    many = min(max(2 * int(length / (2.0 * SHORTEST)), FEWEST), MOST, count)
    ends = np.linspace(0, count, many + 1).round().astype(int).tolist()
    return {
        f"{trial.name}_part_{number}": slice(start, stop)
        for number, (start, stop) in enumerate(pairwise(ends), 1)
    }


def _second(number: int) -> bool:
    """Thue and Morse's sequence: halves that no trend and no period sets apart."""
    return number.bit_count() % 2 == 1
