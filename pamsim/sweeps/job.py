"""What a sweep does in each run: a job takes runs and gives rows of a table."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from pamsim.sweeps.factor import Value

Row: TypeAlias = Mapping[str, float | str]
"""Column -> number or text; a number that a run did not come to is NaN."""

TEXTS = ("outcome", "message")
"""Columns of every job: how a run ended, and why."""


@dataclass(frozen=True, kw_only=True)
class Job(ABC):
    """A job, which must be picklable: it runs in other processes and on other machines.

    Attributes:
        outputs: column of its rows -> unit, ``text`` for text; without `TEXTS`.
        runs_in_block: runs that are worth a task of their own.
    """

    outputs: Mapping[str, str]
    runs_in_block: int = 1

    @property
    def columns(self) -> Mapping[str, str]:
        """Column of its rows -> unit; ``text`` for text."""
        return {**self.outputs, **dict.fromkeys(TEXTS, "text")}

    @abstractmethod
    def rows(self, runs: Sequence[Mapping[str, Value]], threads: int | None) -> list[Row]:
        """One row per run, failed runs included.

        Args:
            runs: factor -> value.
            threads: simulations at a time; None for one per processor.
        """

    def refused(self, why: object) -> dict[str, float | str]:
        """The row of a run that was refused: of numbers and texts there are none."""
        empty = {name: "" if unit == "text" else math.nan for name, unit in self.outputs.items()}
        return {**empty, "outcome": "refused", "message": str(why)}
