"""What benchmarks share: times of several works in turn, and the records of `records`.

A slow phase of the machine hits all works of a round; so a ratio is taken within rounds, and its
median over them.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from pamsim.core.units import FloatArray

sys.path.insert(0, str(Path(__file__).parents[1]))
from records import parser, print_and_write, write

__all__ = ["in_turn", "parser", "print_and_write", "seconds", "write"]


def seconds(work: Callable[[], object], clock: Callable[[], float] = time.perf_counter) -> float:
    """Time of one call [s]."""
    began = clock()
    work()
    return clock() - began


def in_turn(timers: Iterable[Callable[[], float]], rounds: int) -> FloatArray:
    """Times that functions measure in rounds of one call each, shape ``(functions, rounds)``."""
    each = list(timers)
    return np.array([[timer() for timer in each] for _ in range(rounds)]).T
