"""Units that people use, for quantities that are stored in SI units."""

from __future__ import annotations

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
"""SI unit -> common unit; the others are used as they are."""


def common_unit(si_unit: str) -> str:
    """Unit that people use for a physical quantity in an SI unit; a share is in per cent."""
    return "percent" if si_unit == "1" else COMMON.get(si_unit, si_unit)
