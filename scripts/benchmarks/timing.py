"""What benchmarks share: times of several works in turn, and the records of `records`.

A slow phase of the machine hits all works of a round; so a ratio is taken within rounds, and its
median over them.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pamsim.core.computation import versions
from pamsim.core.units import FloatArray

sys.path.insert(0, str(Path(__file__).parents[1]))
from records import noise, parser, print_and_write

__all__ = ["finish", "in_turn", "noise", "parser", "seconds"]


def finish(script: str, found: Mapping[str, Any], path: Path | None, *packages: str) -> None:
    """Print a record, and write it where this is asked for.

    Args:
        script: that made it, with its options.
        found: what was measured.
        path: of the record.
        packages: whose versions are stated besides.
    """
    about = {
        "command": f"python scripts/benchmarks/{script}",
        "load_average": os.getloadavg()[0],
        "processors": os.cpu_count(),
        "versions": versions(*packages),
    }
    print_and_write({**found, **about}, path)


def seconds(work: Callable[[], object], clock: Callable[[], float] = time.perf_counter) -> float:
    """Time of one call [s]."""
    began = clock()
    work()
    return clock() - began


def in_turn(timers: Iterable[Callable[[], float]], rounds: int) -> FloatArray:
    """Times that functions measure in rounds of one call each, shape ``(functions, rounds)``."""
    each = list(timers)
    return np.array([[timer() for timer in each] for _ in range(rounds)]).T
