"""Fit loops: arctangent branches of length over pressure, fractional Maxwell force loops."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError, nearest
from pamsim.core.parameters import specs
from pamsim.hysteresis.arctangent import Arctangent, arctangent
from pamsim.hysteresis.catalog import OPERATORS
from pamsim.store.measured_table import ForceLoops, LengthLoop
from pamsim.sysid.coefficient import Coefficient
from pamsim.sysid.curve_fit import fit_curve, search_curve
from pamsim.sysid.held_out import Rows, grouped, leave_one_group_out
from pamsim.sysid.loop_cost import MAXWELL, LoopPoints, loop_points, maxwell_residual
from pamsim.sysid.search_comparison import SearchRun, compare_searches
from pamsim.workflows.fit_report import FittedCurve, coefficient_entries

FloatArray = NDArray[np.float64]

_NEAR = 1e-3  # of the optimum of (16): near enough [N^2]


def fit_branches(
    table: LengthLoop, *, held: Mapping[str, float], hold_out: str
) -> tuple[FittedCurve, ...]:
    """Fit y = k0 atan(k1 p + k2) + k3 to each branch of a length-pressure loop.

    Args:
        table: the loop.
        held: coefficients to hold in both branches [SI].
        hold_out: ``pressure`` (pressures in turn) or ``none``.

    Returns:
        The rising and the falling branch, as far as they are there.

    Raises:
        InputError: for an unknown coefficient, too few points, or lengths held out, which here are
            what is predicted.
    """
    if hold_out == "length":
        raise InputError("--hold-out length: length is what is fitted here; hold out pressure")
    fits: list[FittedCurve] = []
    for part, rows in (("rising", table.rising), ("falling", ~table.rising)):
        if np.any(rows):
            fits.append(_branch(table.pressure[rows], table.length[rows], part, held, hold_out))
    return tuple(fits)


def branch_section(
    fits: tuple[FittedCurve, ...], table: LengthLoop, nominal_length: float | None
) -> dict[str, dict[str, Any]]:
    """The fitted branches as ``[muscle.hysteresis]`` of the arctangent operator.

    The operator's steepness is \\|k1\\| times the span of pressure, its middle the place of the
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


def fit_maxwell(
    table: ForceLoops, *, held: Mapping[str, float]
) -> tuple[FittedCurve, tuple[LoopPoints, ...]]:
    """Fit order, relaxation time and stiffness to force-displacement loops (seed 001, (16)).

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
    coefficients = _held(MAXWELL, held)
    target = np.zeros(2 * len(loops))
    # (14) and (15) are zero at the optimum: the curve to fit is their left side.
    fit = fit_curve(lambda values: maxwell_residual(values, loops), target, coefficients)
    operator = OPERATORS["fractional_maxwell"]
    fitted = FittedCurve(
        model="fractional_maxwell",
        part="",
        equation=operator.equation,
        source="seed 001, (14) to (16)",
        unit="N",
        points={
            "frequency": np.repeat([loop.frequency for loop in loops], 2),
            "measured": target,
            "predicted": fit.predicted,
        },
        fit=fit,
        held_out=None,
        notes=("stiffness in N per m of displacement; seed 001 does not print its unit",),
    )
    return fitted, loops


def maxwell_points(table: ForceLoops) -> tuple[LoopPoints, ...]:
    """Frequency, force and displacements that the cost looks at, of every loop.

    Raises:
        InputError: naming the loop that has none.
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


def maxwell_section(fitted: FittedCurve, nominal_length: float | None) -> dict[str, dict[str, Any]]:
    """The fitted element as ``[muscle.hysteresis]``; its force needs the nominal length."""
    by_name = coefficient_entries(fitted)
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


def _branch(
    pressure: FloatArray,
    length: FloatArray,
    part: str,
    held: Mapping[str, float],
    hold_out: str,
) -> FittedCurve:
    span = float(np.ptp(pressure))
    size = float(np.ptp(length))
    if span == 0.0 or size == 0.0:
        raise InputError(f"{part} branch: pressure or length does not change; nothing to fit")
    # (k0, k1, k2) and their negatives are the same curve: k0 > 0 picks one.
    coefficients = _held(
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
        points = pressure[rows].tolist()
        return lambda values: np.array([arctangent(p, *values.tolist()) for p in points])

    def fit_and_predict(train: Rows, test: Rows) -> FloatArray:
        return over(test)(search_curve(over(train), length[train], coefficients).values)

    fit = fit_curve(over(np.arange(length.size)), length, coefficients)
    held_out = None
    if hold_out == "pressure":
        held_out = leave_one_group_out(length, grouped(pressure), fit_and_predict, by="pressure")
    operator = OPERATORS["arctangent"]
    return FittedCurve(
        model="arctangent",
        part=part,
        equation="y = k0 atan(k1 p + k2) + k3",
        source=operator.source,
        unit="m",
        points={"pressure": pressure, "measured": length, "predicted": fit.predicted},
        fit=fit,
        held_out=held_out,
    )


def _held(
    coefficients: tuple[Coefficient, ...], held: Mapping[str, float]
) -> tuple[Coefficient, ...]:
    names = [c.name for c in coefficients]
    for name, value in held.items():
        if name not in names:
            raise InputError(f"no coefficient {name!r} to hold; {nearest(name, names)}")
        if not math.isfinite(value):
            raise InputError(f"--hold {name}={value:g} is not finite")
    return tuple(
        Coefficient(
            name=c.name, unit=c.unit, low=c.low, high=c.high, default=c.default,
            held=held.get(c.name),
        )
        for c in coefficients
    )  # fmt: skip
