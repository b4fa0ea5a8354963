"""Units at the border: files and screens speak kPa, deg and mm, everything inside speaks SI."""

from __future__ import annotations

import functools
import math
import re
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.core.limits import QUANTITY_CHARACTERS

PA_PER_KPA = 1e3
PA_PER_BAR = 1e5
DEG_PER_RAD = 180.0 / math.pi
MM_PER_M = 1e3

FloatArray: TypeAlias = NDArray[np.float64]
"""Numbers, in SI unless something else is stated."""

COMMON = {
    "rad": "deg",
    "Pa": "kPa",
    "m": "mm",
    "m/s": "mm/s",
    "m/N": "mm/kN",
    "m^3": "cm^3",
    "m^3/(s*Pa)": "mm^3/(s*kPa)",
    "N/Pa": "N/bar",
    "Pa*s/kg": "kPa*s/g",
    "kg/s": "mg/s",
}
"""SI unit -> unit that people use; the others are used as they are."""


def common_unit(si_unit: str) -> str:
    """Unit that people use for a physical quantity in an SI unit; a share is in per cent."""
    return "percent" if si_unit == "1" else COMMON.get(si_unit, si_unit)


_USUAL = {
    ("kPa", "Pa"): 1e3,
    ("bar", "Pa"): 1e5,
    ("mm", "m"): 1e-3,
    ("ms", "s"): 1e-3,
    ("deg", "rad"): 1.0 / DEG_PER_RAD,
    ("g", "kg"): 1e-3,
    ("percent", "1"): 1e-2,
    ("percent/bar", "1/Pa"): 1.0000000000000001e-07,
    ("cm^2", "m^2"): 1e-4,
    ("cm^3", "m^3"): 1.0000000000000002e-06,
    ("dm^3/(s*bar)", "m^3/(s*Pa)"): 1.0000000000000004e-08,
    ("kPa/V", "Pa/V"): 1e3,
    ("N/bar", "N/Pa"): 1e-5,
}
"""Factors of usual units as pint computes them: a rig and a command need no others."""


@functools.cache
def _registry() -> Any:
    # Imported here: pint takes a third of a second, more than most commands run.
    import pint

    registry: Any = pint.UnitRegistry()  # pyright: ignore[reportUnknownVariableType]
    return registry


def to_si(value: float, unit: str, si_unit: str, *, where: str) -> float:
    """Convert a number in a unit as written, such as ``dm^3/(s*bar)``, ``1`` for none, to SI.

    File and key ``where`` it stands are named in errors.

    Raises:
        InputError: if the unit is unknown or measures another quantity.
    """
    if unit == si_unit or (unit, si_unit) in _USUAL:
        return value * _USUAL.get((unit, si_unit), 1.0)
    import pint

    try:
        hertz = [bool(_HERTZ.search(one)) for one in (unit, si_unit)]
        if hertz[0] != hertz[1] and _TURN.search(unit + si_unit):
            # A radian has no dimension, so that a turn per second would be a radian per second.
            raise pint.DimensionalityError(unit, si_unit)
        factor = _factor(unit, si_unit)
        return value * factor if factor is not None else _converted(value, unit, si_unit)
    except pint.DimensionalityError:
        wrong = f"does not measure what is wanted here; write a unit that converts to {si_unit!r}"
    except Exception:  # pint's parser fails in many ways: tokens, types, division, assertions
        wrong = (
            "is not known; write one such as kPa, bar, mm, deg, kg, N/bar that converts to"
            f" {si_unit!r}"
        )
    raise InputError(f"{where}: unit {unit!r} {wrong}")


_HERTZ = re.compile(r"hz|hertz", re.IGNORECASE)
_TURN = re.compile(r"rad|deg|turn|rev|rpm")


@functools.lru_cache(maxsize=1024)
def _factor(unit: str, si_unit: str) -> float | None:
    """SI units in a unit; None for a unit with another zero, such as degC."""
    # The parser would compute some powers of numbers for ever: units have small whole exponents.
    powers = len(re.findall(r"\^|\*\*", unit))
    if powers != len(_POWER.findall(unit)) or re.search(r"\d[\s)]*(\^|\*\*)", unit):
        raise ValueError(unit)
    return _converted(1.0, unit, si_unit) if _converted(0.0, unit, si_unit) == 0.0 else None


def _converted(value: float, unit: str, si_unit: str) -> float:
    return float(_registry().Quantity(value, unit).to(si_unit).magnitude)


_POWER = re.compile(r"(?:\^|\*\*)\s*-?\d(?![\d.(])")


_QUANTITY = re.compile(
    r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?|[+-]?(?:nan|inf))\s*(.*)", re.IGNORECASE
)


def parse_quantity(text: str, default_unit: str, si_unit: str, *, where: str) -> float:
    """Read a number with an optional unit, such as ``487``, ``4.87 bar`` or ``30deg``, as SI.

    A bare number is in the default unit; ``nan`` and ``inf`` are passed on for the caller to judge.

    Raises:
        InputError: if it is no number, or its unit is unknown or of another quantity.
    """
    number, unit = number_and_unit(text, where=where)
    return to_si(number, unit or default_unit, si_unit, where=where)


def number_and_unit(text: str, *, where: str) -> tuple[float, str]:
    """A number in any unit, and that unit as written, empty where there is none: ``4.87``, ``bar``.

    InputError if it is no number.
    """
    long = len(text) > QUANTITY_CHARACTERS
    match = None if long else _QUANTITY.fullmatch(text)
    if match is None:
        what = f"{len(text)} characters are" if long else f"{text!r} is"
        raise InputError(f"{where}: {what} not a number; write one such as 487 or 4.87bar")
    return float(match[1]), match[2].strip()
