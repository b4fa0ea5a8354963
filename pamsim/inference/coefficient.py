"""Coefficients of a curve before a fit: range, neutral value, whether held."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

from pamsim.core.errors import InputError, nearest


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


def held_coefficients(
    coefficients: tuple[Coefficient, ...], held: Mapping[str, float]
) -> tuple[Coefficient, ...]:
    """The coefficients of a curve, those named in ``held`` at its values [SI].

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
                f"{c.name} held at {held[c.name]:g} is outside [{c.low:.4g}, {c.high:.4g}]"
                f" {c.unit}, which the data allow"
            )
    return tuple(dataclasses.replace(c, held=held.get(c.name)) for c in coefficients)
