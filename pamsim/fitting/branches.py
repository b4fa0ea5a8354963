"""Fit arctangent branches to a length-pressure loop (Alraouf 2025, (1) and (2))."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.parameters import specs
from pamsim.core.units import FloatArray
from pamsim.fitting.curve_fit import fit_curve, search_curve
from pamsim.fitting.held_out import Rows, grouped, leave_one_group_out
from pamsim.fitting.result import FittedLaw
from pamsim.inference.coefficient import Coefficient, held_coefficients
from pamsim.physics.hysteresis.arctangent import Arctangent
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.recordings.measured_table import LengthLoop
from pamsim.recordings.printed import arctangent_law


def fit_branches(
    table: LengthLoop, *, held: Mapping[str, float], hold_out: str
) -> tuple[FittedLaw, ...]:
    """Fit y = k0 atan(k1 p + k2) + k3 to each branch of a length-pressure loop.

    Args:
        table: the loop.
        held: coefficients to hold in both branches [SI].
        hold_out: ``pressure`` (pressures in turn) or ``none``.

    Returns:
        The rising and the falling branch, those that the loop has.

    Raises:
        InputError: for an unknown coefficient, too few points, or held-out lengths, since the
            length is what is predicted.
    """
    if hold_out == "length":
        raise InputError("`hold_out` length: length is what is fitted here; hold out pressure")
    fits: list[FittedLaw] = []
    for part, rows in (("rising", table.rising), ("falling", ~table.rising)):
        if np.any(rows):
            fits.append(_branch(table.pressure[rows], table.length[rows], part, held, hold_out))
    return tuple(fits)


def branch_section(
    fits: tuple[FittedLaw, ...], table: LengthLoop, nominal_length: float | None
) -> dict[str, dict[str, Any]]:
    """The fitted branches as ``[muscle.hysteresis]`` of the arctangent operator.

    The operator's steepness is |k1| times the span of pressure, its middle the place of the
    steepest point in it. The contraction where the branches meet above needs the nominal length.
    """
    low, high = float(np.min(table.pressure)), float(np.max(table.pressure))
    known = dict(specs(Arctangent))
    entries: dict[str, Any] = {"law": "arctangent"}
    for fitted in fits:
        values = {c.name: c for c in fitted.fit.coefficients}
        k1, k2 = values["k1"], values["k2"]
        steepness = {"value": abs(k1.value) * (high - low), "unit": "1", "source": "identified"}
        if k1.interval95 is not None:
            ends = sorted(abs(end) * (high - low) for end in k1.interval95)
            if k1.interval95[0] * k1.interval95[1] > 0.0:
                steepness["interval95"] = ends
        entries[f"steepness_{fitted.part}"] = steepness
        place = (-k2.value / k1.value - low) / (high - low)
        spec = known[f"middle_{fitted.part}"]
        entry: dict[str, Any] = {"value": min(max(place, spec.low), spec.high), "unit": "1"}
        entry["source"] = "identified"
        if not spec.low <= place <= spec.high:
            entry["note"] = (
                f"the steepest point lies outside the measured pressures, at {place:.2f}"
            )
        entries[f"middle_{fitted.part}"] = entry
    if nominal_length is not None:
        shortest = float(np.min(table.length))
        entries["high_contraction"] = {
            "value": 1.0 - shortest / nominal_length,
            "unit": "1",
            "source": "identified",
            "note": "the shortest measured length",
        }
    return {"muscle.hysteresis": entries}


def _branch(
    pressure: FloatArray,
    length: FloatArray,
    part: str,
    held: Mapping[str, float],
    hold_out: str,
) -> FittedLaw:
    span = float(np.ptp(pressure))
    size = float(np.ptp(length))
    if span == 0.0 or size == 0.0:
        raise InputError(f"{part} branch: pressure or length does not change; nothing to fit")
    # (k0, k1, k2) and their negatives are the same curve: k0 > 0 picks one.
    coefficients = held_coefficients(
        (
            Coefficient(name="k0", unit="m", low=0.01 * size, high=20.0 * size),
            Coefficient(name="k1", unit="1/Pa", low=-50.0 / span, high=50.0 / span),
            Coefficient(name="k2", unit="1", low=-20.0, high=20.0),
            Coefficient(
                name="k3",
                unit="m",
                low=float(np.min(length)) - 20.0 * size,
                high=float(np.max(length)) + 20.0 * size,
            ),
        ),
        held,
    )

    def over(rows: Rows) -> Callable[[FloatArray], FloatArray]:
        points = pressure[rows]
        return lambda values: arctangent_law(points, *values.tolist())

    def fit_and_predict(train: Rows, test: Rows) -> FloatArray:
        return over(test)(search_curve(over(train), length[train], coefficients).values)

    fit = fit_curve(over(np.arange(length.size)), length, coefficients)
    held_out = None
    if hold_out == "pressure":
        held_out = leave_one_group_out(length, grouped(pressure), fit_and_predict, by="pressure")
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
