"""A fitted parameter as text."""

from __future__ import annotations

import math
from typing import Protocol

_DIGITS = 3  # of a size that is printed


class Value(Protocol):
    """A number with its unit and 95 % interval."""

    @property
    def value(self) -> float:
        """The number, in ``unit``."""
        ...

    @property
    def unit(self) -> str:
        """``1`` for none."""
        ...

    @property
    def interval95(self) -> tuple[float, float] | None:
        """Both ends; None or infinite where they are not known."""
        ...


def sized(name: str, one: Value) -> str:
    """A fitted parameter as text, such as ``leak conductance 1.98 [1.92, 2.07] mm^3/(s*kPa)``."""
    label = name.rpartition(".")[2].replace("_", " ")
    digits, ends = _DIGITS, one.interval95
    known = ends is not None and all(map(math.isfinite, ends))
    if ends is not None and known:
        low, high = ends
        largest = max(abs(low), abs(high), abs(one.value))
        if low < high:  # two digits of half its width
            digits = max(digits, 2 + math.floor(math.log10(2.0 * largest / (high - low))))
    text = f"{label} {one.value:.{digits}g}"
    if ends is not None and known:
        text += f" [{', '.join(f'{end:.{digits}g}' for end in ends)}]"
    return text if one.unit == "1" else f"{text} {one.unit}"
