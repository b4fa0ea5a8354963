"""Coefficients of a curve before and after a fit: range, value, interval, reasons for doubt."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from pamsim.core.errors import InputError, nearest

Interval = tuple[float, float]


class Doubt(StrEnum):
    """Why a fitted coefficient should not be quoted as it stands."""

    DEAD = "dead"
    """The data do not depend on it."""
    FLAT_DIRECTION = "flat_direction"
    """It can change together with others without changing the curve."""
    AT_BOUND = "at_bound"
    """It ran into its allowed range, which then decides, not the data."""
    TRADE_OFF = "trade_off"
    """It is correlated by more than 0.95 with another: only a combination is determined."""
    NOT_PINNED = "not_pinned"
    """Of a curve: its 95 % interval is wider than the value on either side, so that not even the
    sign is known. Of a calibration: its standard error is larger than its allowed range."""


@dataclass(frozen=True, kw_only=True)
class Coefficient:
    """What a fit may do with a coefficient.

    Attributes:
        name: of the coefficient.
        unit: SI.
        low: smallest value.
        high: largest value.
        default: neutral value if there is one; a start of the search.
        held: the value to hold, or None to fit it.
    """

    name: str
    unit: str
    low: float
    high: float
    default: float | None = None
    held: float | None = None


@dataclass(frozen=True, kw_only=True)
class FittedCoefficient:
    """A coefficient after a fit.

    Attributes:
        name: of the coefficient.
        unit: SI, of value, interval and bounds.
        value: at the optimum, or as held.
        interval95: linearised 95 % interval; None if held or not determined by the data.
        bounds: range the fit was allowed.
        held: True if it was not fitted.
        doubts: why not to quote it; empty if there is no reason.
        partners: coefficients it trades off or shares a flat direction with.
    """

    name: str
    unit: str
    value: float
    interval95: Interval | None
    bounds: Interval
    held: bool
    doubts: tuple[Doubt, ...] = ()
    partners: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """JSON-safe form, SI."""
        return {
            "name": self.name,
            "unit": self.unit,
            "value": self.value,
            "interval95": None if self.interval95 is None else list(self.interval95),
            "bounds": list(self.bounds),
            "held": self.held,
            "doubts": [str(doubt) for doubt in self.doubts],
            "partners": list(self.partners),
        }


def held_coefficients(
    coefficients: tuple[Coefficient, ...], held: Mapping[str, float]
) -> tuple[Coefficient, ...]:
    """Mark coefficients as held.

    Args:
        coefficients: of a curve.
        held: name -> value [SI].

    Returns:
        The coefficients, the named ones held.

    Raises:
        InputError: for a name that is not among them, or a value outside the range.
    """
    names = [c.name for c in coefficients]
    for name in held:
        if name not in names:
            raise InputError(f"no coefficient {name!r} to hold; {nearest(name, names)}")
    for c in coefficients:
        if c.name in held and not c.low <= held[c.name] <= c.high:
            raise InputError(
                f"--hold {c.name}={held[c.name]:g} is outside [{c.low:.4g}, {c.high:.4g}] {c.unit},"
                " which the data allow"
            )
    return tuple(dataclasses.replace(c, held=held.get(c.name)) for c in coefficients)
