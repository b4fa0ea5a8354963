"""Rows at rest beside what was found in them, as a result states them."""

from __future__ import annotations

from dataclasses import dataclass

from pamsim.core.units import FloatArray


@dataclass(frozen=True, kw_only=True)
class RowEntry:
    """A row of a table, its errors by fits to the others.

    Attributes:
        row: its name.
        pressure_kpa: of every muscle.
        load_kg: on the arm.
        angle_deg: as measured.
        before_deg: simulated minus measured, nuisance parameters refitted.
        after_deg: the same with the effects that were found; None without any.
    """

    row: str
    pressure_kpa: tuple[float, ...]
    load_kg: float
    angle_deg: float
    before_deg: float
    after_deg: float | None


@dataclass(frozen=True, kw_only=True)
class Branches:
    """The branches of a loop at the pressures that were read on both, (m,) each.

    Attributes:
        pressure_kpa: of the levels.
        rising_mm: length while the pressure rises.
        falling_mm: length while it falls.
        error_mm: standard error of the difference; None if it is not known.
        opened_mm: rising less falling length by the effects that were found; None without any.
    """

    pressure_kpa: FloatArray
    rising_mm: FloatArray
    falling_mm: FloatArray
    error_mm: FloatArray | None
    opened_mm: FloatArray | None
