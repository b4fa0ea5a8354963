"""A table over frequency: magnitude and phase, or real and imaginary part, of a response."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.core.units import DEG_PER_RAD, FloatArray
from pamsim.recordings.columns import Columns

_MEANS: Mapping[str, re.Pattern[str]] = {
    quantity: re.compile(rf"(?:{names})_?(?P<unit>{units})?")
    for quantity, names, units in (
        ("frequency", "f|freq|frequency", "k?hz|rad_s"),
        ("omega", "w|omega", "k?hz|rad_s"),
        ("magnitude", "mag|magnitude|gain|amplitude|abs", "db|abs|ratio|1"),
        ("phase", "phase|phi|arg", "deg|degrees|rad"),
        ("real", "re|real", "1"),
        ("imaginary", "im|imag|imaginary", "1"),
    )
}
"""Quantity -> names of its column in lower case, unit included, all else than letters as ``_``."""

_FREQUENCY_UNITS = {"hz": 2.0 * np.pi, "khz": 2e3 * np.pi, "rad_s": 1.0}


def is_over_frequency(table: Columns) -> bool:
    """Whether a table is a frequency response by the names of its columns."""
    found = _found(table)
    over = "frequency" in found or "omega" in found
    return over and ({"magnitude", "phase"} <= set(found) or {"real", "imaginary"} <= set(found))


def frequency_response_of(
    table: Columns,
) -> tuple[FloatArray, NDArray[np.complex128], tuple[str, ...]]:
    """Read a frequency response.

    Of columns such as ``frequency_hz`` or ``omega_rad_s``, and ``magnitude`` or ``magnitude_db``
    with ``phase_deg`` or ``phase_rad``, or ``real`` and ``imaginary``.

    Returns:
        Frequencies [rad/s], rising; the complex response; and what was assumed.

    Raises:
        InputError: for another table, a cell that is no number, or a negative magnitude.
    """
    found, notes = _found(table), list[str]()
    if not is_over_frequency(table):
        raise InputError(
            f"{table.path}: no frequency response: name columns frequency_hz or omega_rad_s, and"
            " magnitude or magnitude_db with phase_deg, or real and imaginary (there are:"
            f" {', '.join(table.cells)})"
        )

    def unit(quantity: str, usual: str) -> str:
        name, stated = found[quantity]
        if not stated:
            notes.append(f"{table.path.name}: {name} is taken to be in {usual}")
        return stated or usual

    over = "omega" if "omega" in found else "frequency"
    per_unit = _FREQUENCY_UNITS[unit(over, "rad_s" if over == "omega" else "hz")]
    frequency = table.numbers(found[over][0]) * per_unit
    if "real" in found and "imaginary" in found:
        response = np.asarray(
            table.numbers(found["real"][0]) + 1j * table.numbers(found["imaginary"][0]),
            np.complex128,
        )
    else:
        magnitude = table.numbers(found["magnitude"][0])
        if found["magnitude"][1] == "db":
            magnitude = 10.0 ** (magnitude / 20.0)
        table.refuse(
            magnitude < 0.0,
            lambda row: (
                f"{found['magnitude'][0]} = {magnitude[row]:g} is negative; name the column"
                " magnitude_db if it is in decibels"
            ),
        )
        phase = table.numbers(found["phase"][0])
        if unit("phase", "deg") != "rad":
            phase = phase / DEG_PER_RAD
        response = np.asarray(magnitude * np.exp(1j * phase), np.complex128)
    order = np.argsort(frequency, kind="stable")
    return (
        frequency[order],
        response[order],
        tuple(note.replace("rad_s", "rad/s") for note in notes),
    )


def _found(table: Columns) -> dict[str, tuple[str, str]]:
    """Quantity -> column and unit, empty where the column states none."""
    found: dict[str, tuple[str, str]] = {}
    for name in table.cells:
        stated = table.units.get(name, "")
        plain = re.sub(r"[^a-z0-9]+", "_", f"{name} {stated}".lower().replace("°", "deg"))
        for quantity, names in _MEANS.items():
            match = names.fullmatch(plain.strip("_"))
            if match and quantity not in found:
                found[quantity] = name, match["unit"] or ""
    return found
