"""Fit arctangent branches to a length-pressure loop (Alraouf 2025, (1) and (2))."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.parameters import specs
from pamsim.core.units import FloatArray
from pamsim.fitting.coefficients import Coefficient, Curve, held_coefficients
from pamsim.fitting.curve_fit import fit_curve, held_out_in_turn
from pamsim.fitting.result import FittedLaw
from pamsim.fitting.scores import Rows, grouped
from pamsim.physics.hysteresis.arctangent import Arctangent
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.recordings.measured_table import LengthLoop
from pamsim.recordings.printed import arctangent_law


def fit_branches(
    table: LengthLoop, *, held: Mapping[str, float], hold_out: str
) -> tuple[FittedLaw, ...]:
    """Fit y = k0 atan(k1 p + k2) + k3 to each branch that a length-pressure loop has.

    Coefficients are ``held`` in both branches [SI]; ``hold_out`` is ``pressure`` (pressures in
    turn) or ``none``.

    Raises:
        InputError: for an unknown coefficient, k1 held at 0, too few points, or held-out lengths,
            since the length is what is predicted.
    """
    if hold_out == "length":
        raise InputError("`hold_out` length: length is what is fitted here; hold out pressure")
    if held.get("k1") == 0.0:
        raise InputError("`held` k1 = 0: no pressure changes the length then; give another value")
    return tuple(
        _branch(table.pressure[rows], table.length[rows], part, held, hold_out)
        for part, rows in (("rising", table.rising), ("falling", ~table.rising))
        if np.any(rows)
    )


def branch_section(
    fits: tuple[FittedLaw, ...], table: LengthLoop, nominal_length: float | None
) -> dict[str, dict[str, Any]]:
    """The fitted branches as ``[muscle.hysteresis]`` of the arctangent operator.

    The operator's steepness is |k1| times the span of pressure, its middle the place of the
    steepest point in it. The contraction where the branches meet above needs the nominal length.

    Raises:
        InputError: for a nominal length that the muscle is never shorter than.
    """
    low, high = float(np.min(table.pressure)), float(np.max(table.pressure))
    known = dict(specs(Arctangent))
    entries: dict[str, Any] = {"law": "arctangent"}
    for fitted in fits:
        values = {c.name: c for c in fitted.fit.coefficients}
        k1, k2 = values["k1"], values["k2"]
        steepness = _number(abs(k1.value) * (high - low), held=k1.held)
        if k1.interval95 is not None and k1.interval95[0] * k1.interval95[1] > 0.0:
            steepness["interval95"] = sorted(abs(end) * (high - low) for end in k1.interval95)
        place = (-k2.value / k1.value - low) / (high - low)
        spec = known[f"middle_{fitted.part}"]
        middle = _number(min(max(place, spec.low), spec.high), held=k1.held and k2.held)
        if middle["value"] != place:
            middle["note"] = (
                f"the steepest point lies outside the measured pressures, at {place:.2f}"
            )
        entries |= {f"steepness_{fitted.part}": steepness, f"middle_{fitted.part}": middle}
    if nominal_length is not None:
        shortest = float(np.min(table.length))
        contraction = 1.0 - shortest / nominal_length
        if contraction <= 0.0:
            raise InputError(
                f"`nominal_length` = {1e3 * nominal_length:.4g} mm: no length of the table is"
                f" below it, the shortest is {1e3 * shortest:.4g} mm; check both units"
            )
        note = {"note": "the shortest measured length"}
        entries["high_contraction"] = _number(contraction) | note
    return {"muscle.hysteresis": entries}


def _number(value: float, *, held: bool = False) -> dict[str, Any]:
    if held:
        return {"value": value, "unit": "1", "source": "assumed", "note": "held in the fit"}
    return {"value": value, "unit": "1", "source": "identified"}


def _branch(
    pressure: FloatArray, length: FloatArray, part: str, held: Mapping[str, float], hold_out: str
) -> FittedLaw:
    span, size = float(np.ptp(pressure)), float(np.ptp(length))
    if span == 0.0 or size == 0.0:
        raise InputError(f"{part} branch: pressure or length does not change; nothing to fit")
    # (k0, k1, k2) and their negatives are the same curve: k0 > 0 picks one.
    shortest, longest = float(np.min(length)), float(np.max(length))
    ranges = (
        ("k0", "m", 0.01 * size, 20.0 * size),
        ("k1", "1/Pa", -50.0 / span, 50.0 / span),
        ("k2", "1", -20.0, 20.0),
        ("k3", "m", shortest - 20.0 * size, longest + 20.0 * size),
    )
    coefficients = held_coefficients(
        tuple(Coefficient(name=n, unit=u, low=low, high=high) for n, u, low, high in ranges), held
    )

    def over(rows: Rows) -> Curve:
        points = pressure[rows]
        return lambda values: arctangent_law(points, *values.tolist())

    fit = fit_curve(over(np.arange(length.size)), length, coefficients)
    held_out = None
    if hold_out == "pressure":
        held_out = held_out_in_turn(over, length, coefficients, grouped(pressure), by="pressure")
    operator = OPERATORS["arctangent"]
    return FittedLaw(
        model="arctangent",
        part=part,
        title=operator.title,
        equation="y = k0 atan(k1 p + k2) + k3",
        source=operator.source,
        unit="m",
        points={"pressure": pressure, "measured": length, "predicted": fit.predicted},
        fit=fit,
        held_out=held_out,
    )
