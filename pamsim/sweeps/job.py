"""What a sweep does in each run: a job takes runs and gives rows of a table."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Protocol, TypeAlias

from pamsim.sweeps.factor import Value

Row: TypeAlias = Mapping[str, float | str]
"""Column -> number or text; a number that a run did not come to is NaN."""


def refused(columns: Mapping[str, str], why: object) -> Row:
    """The row of a run that was refused: of numbers and texts there are none."""
    empty = {name: "" if unit == "text" else math.nan for name, unit in columns.items()}
    return {**empty, "outcome": "refused", "message": str(why)}


class Job(Protocol):
    """A job, which must be picklable: it runs in other processes and on other machines."""

    @property
    def columns(self) -> Mapping[str, str]:
        """Column of its rows -> unit; ``text`` for text."""
        ...

    @property
    def runs_in_block(self) -> int:
        """Runs that are worth a task of their own."""
        ...

    def rows(self, runs: Sequence[Mapping[str, Value]], threads: int | None) -> list[Row]:
        """One row per run, failed runs included.

        Args:
            runs: factor -> value.
            threads: simulations at a time; None for one per processor.
        """
        ...
