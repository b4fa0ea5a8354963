"""Whether an ordinary parameter has one value in all protocols."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Regime:
    """An ordinary parameter, fitted to each protocol by itself.

    Attributes:
        parameter: its name.
        p_value: of one value in all protocols.
        values: protocol -> value and the ends of its 95 % interval [SI].
    """

    parameter: str
    p_value: float
    values: Mapping[str, tuple[float, float, float]]
