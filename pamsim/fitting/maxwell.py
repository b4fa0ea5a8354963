"""Fit a fractional Maxwell element to force-displacement loops (Nguyen 2024, (14) to (16))."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from pamsim.core.errors import InputError
from pamsim.fitting.curve_fit import fit_curve
from pamsim.fitting.loop_cost import MAXWELL, LoopPoints, loop_points, maxwell_residual
from pamsim.fitting.params_section import coefficient_entries
from pamsim.fitting.result import FittedLaw
from pamsim.fitting.search_comparison import SearchRun, compare_searches
from pamsim.inference.coefficient import held_coefficients
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.recordings.measured_table import ForceLoops

_NEAR = 1e-3  # of the optimum of (16): near enough [N^2]


def fit_maxwell(
    table: ForceLoops, *, held: Mapping[str, float]
) -> tuple[FittedLaw, tuple[LoopPoints, ...]]:
    """Fit order, relaxation time and stiffness to force-displacement loops (Nguyen 2024, (16)).

    Args:
        table: loops, at two frequencies at least.
        held: coefficients to hold, by their searched names [log10 of SI].

    Returns:
        The fit and the points of the loops it used.

    Raises:
        InputError: for a loop without a harmonic force, an unknown coefficient, or too few loops:
            one gives two equations for three unknowns.
    """
    loops = maxwell_points(table)
    coefficients = held_coefficients(MAXWELL, held)
    target = np.zeros(2 * len(loops))
    # (14) and (15) are zero at the optimum: the curve to fit is their left side.
    fit = fit_curve(lambda values: maxwell_residual(values, loops), target, coefficients)
    operator = OPERATORS["fractional_maxwell"]
    fitted = FittedLaw(
        model="fractional_maxwell",
        title=operator.title,
        equation=operator.equation,
        source="Nguyen 2024, (14) to (16)",
        unit="N",
        points={
            "frequency": np.repeat([loop.frequency for loop in loops], 2),
            "measured": target,
            "predicted": fit.predicted,
        },
        fit=fit,
        notes=("stiffness in N per m of displacement; Nguyen 2024 does not print its unit",),
    )
    return fitted, loops


def maxwell_points(table: ForceLoops) -> tuple[LoopPoints, ...]:
    """Frequency, force and displacements of every loop, as the cost uses them.

    Raises:
        InputError: naming the loop that has no harmonic force.
    """
    loops: list[LoopPoints] = []
    for name, *record in zip(table.names, table.time, table.force, table.displacement, strict=True):
        try:
            loops.append(loop_points(*record))
        except InputError as error:
            raise InputError(f"loop {name}: {error}") from None
    if len(loops) < 2 or max(p.frequency for p in loops) < 1.05 * min(p.frequency for p in loops):
        raise InputError(
            "loops at one frequency give two equations for three unknowns; add a loop at another"
            " frequency, marked in a column 'loop'"
        )
    return tuple(loops)


def searches_on(loops: tuple[LoopPoints, ...]) -> tuple[SearchRun, ...]:
    """Water cycle, differential evolution and least squares on the cost of the loops."""
    return compare_searches(
        lambda values: maxwell_residual(values, loops),
        [c.low for c in MAXWELL],
        [c.high for c in MAXWELL],
        tolerance=_NEAR,
    )


def maxwell_section(fitted: FittedLaw, nominal_length: float | None) -> dict[str, dict[str, Any]]:
    """The fitted element as ``[muscle.hysteresis]``; its force needs the nominal length."""
    by_name = coefficient_entries(fitted.fit.coefficients)
    order, beta, stiffness = (by_name[c.name] for c in MAXWELL)
    entries: dict[str, Any] = {
        "law": "fractional_maxwell",
        "order": order,
        "time_constant": _from_log10(beta, "s"),
    }
    if nominal_length is not None:
        span = 0.01
        entries["span"] = {"value": span, "unit": "1", "source": "assumed", "note": "sets only"
                           " the unit of force"}  # fmt: skip
        per_metre = _from_log10(stiffness, "N")
        scaled = span * nominal_length
        per_metre["value"] *= scaled
        if "interval95" in per_metre:
            per_metre["interval95"] = [scaled * end for end in per_metre["interval95"]]
        entries["force"] = per_metre
    return {"muscle.hysteresis": entries}


def _from_log10(entry: dict[str, Any], unit: str) -> dict[str, Any]:
    plain = {**entry, "value": 10.0 ** entry["value"], "unit": unit}
    if "interval95" in entry:
        plain["interval95"] = [10.0 ** min(end, 300.0) for end in entry["interval95"]]
    return plain
