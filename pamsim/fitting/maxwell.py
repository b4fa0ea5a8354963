"""Fit a fractional Maxwell element to force-displacement loops (Nguyen 2024, (14) to (16)).

Under F = F0 sin(w t) the loop passes through (x1, F0) and (x2 < 0, 0). With g = (w beta)^alpha the
model asks there

    (14)  Ke g x1 - (g + cos(alpha pi/2)) F0 = 0,      (15)  Ke g x2 + F0 sin(alpha pi/2) = 0,

and the cost (16) is the sum of their squares over all loops. One loop gives two equations for three
unknowns: loops at two frequencies at least are needed. The unit of Ke follows the displacement's.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.fitting.coefficients import Coefficient, held_coefficients
from pamsim.fitting.curve_fit import fit_curve
from pamsim.fitting.result import FittedLaw, coefficient_entries
from pamsim.fitting.water_cycle import SearchRun, compare_searches
from pamsim.inference.record_checks import increasing_time
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.recordings.measured_table import ForceLoops

_NEAR = 1e-3  # of the optimum of (16): near enough [N^2]

MAXWELL = (
    Coefficient(name="alpha", unit="1", low=0.01, high=0.99),
    Coefficient(name="log10_beta", unit="1", low=-3.0, high=4.0),
    Coefficient(name="log10_stiffness", unit="1", low=1.0, high=7.0),
)
"""What is searched: order [-], relaxation time [s] and stiffness [N/m] by their exponents of ten.

The last two span decades, and any search in their plain values spends itself on the last decade."""


class LoopPoints(NamedTuple):
    """The points of a loop that the cost uses."""

    frequency: float  # w [rad/s]
    force: float  # amplitude F0 [N]
    at_force: float  # displacement x1 where the force is F0 [m]
    at_zero: float  # displacement x2 where the force passes zero upwards [m], negative


def loop_points(time: ArrayLike, force: ArrayLike, displacement: ArrayLike) -> LoopPoints:
    """Read w, F0, x1 and x2 off a loop: time [s], force [N] and displacement [m], (n,) each.

    The frequency is the one that leaves the smallest harmonic residual in force; x1 and x2 are
    those of the displacement's own first harmonic, counted from its mean, so that noise and
    offsets do not enter.

    Raises:
        InputError: for a record that is short, unordered, not finite, less than a period, not
            harmonic in force, or whose displacement leads the force.
    """
    t, f = increasing_time(time, force, 16)
    _, x = increasing_time(time, displacement, 16)
    t = t - t[0]
    frequency = _frequency(t, f)
    force_sine, miss = _harmonic(t, f, frequency)
    if miss > 0.3:
        raise InputError(
            f"force is not a sine: {100.0 * miss:.0f} % of its variation is something else;"
            " give a record under one steady harmonic force"
        )
    shift_sine, _ = _harmonic(t, x, frequency)
    amplitude = abs(force_sine)
    # In phase with the force: value at its crest. A quarter period before: value at its zero.
    relative = shift_sine / force_sine * amplitude
    if relative.imag >= 0.0:
        raise InputError(
            "displacement leads the force: a passive muscle lags behind it; check signs and columns"
        )
    return LoopPoints(
        frequency=frequency,
        force=amplitude,
        at_force=float(relative.real),
        at_zero=float(relative.imag),
    )


def maxwell_residual(values: FloatArray, loops: tuple[LoopPoints, ...]) -> FloatArray:
    """Left sides (2 n,) [N] of (14) and (15), whose squares add up to the cost (16).

    ``values`` (3,) are as in `MAXWELL`.
    """
    alpha, beta, stiffness = values[0], 10.0 ** values[1], 10.0 ** values[2]
    quarter = 0.5 * np.pi * alpha
    result: list[float] = []
    for loop in loops:
        g = (loop.frequency * beta) ** alpha
        result.append(stiffness * g * loop.at_force - (g + np.cos(quarter)) * loop.force)
        result.append(stiffness * g * loop.at_zero + loop.force * np.sin(quarter))
    return np.array(result)


def maxwell_loop(
    alpha: float, beta: float, stiffness: float, frequency: float, force: float
) -> LoopPoints:
    """Points of the model's own loop: (14) and (15) solved for x1 and x2.

    Order alpha [-], beta [s], stiffness Ke [N/m], frequency w [rad/s] and force F0 [N] in SI.
    """
    g, quarter = (frequency * beta) ** alpha, 0.5 * np.pi * alpha
    return LoopPoints(
        frequency=frequency,
        force=force,
        at_force=float((g + np.cos(quarter)) * force / (stiffness * g)),
        at_zero=float(-force * np.sin(quarter) / (stiffness * g)),
    )


def fit_maxwell(
    table: ForceLoops, *, held: Mapping[str, float]
) -> tuple[FittedLaw, tuple[LoopPoints, ...]]:
    """Fit order, relaxation time and stiffness to loops, by the cost (16).

    Coefficients are ``held`` by their searched names [log10 of SI]. With the fit go the points of
    the loops that it used.

    Raises:
        InputError: naming a loop without a harmonic force, an unknown coefficient, or for loops at
            one frequency.
    """
    loops = _points(table)
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


def _points(table: ForceLoops) -> tuple[LoopPoints, ...]:
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
        note = "sets only the unit of force"
        entries["span"] = {"value": span, "unit": "1", "source": "assumed", "note": note}
        entries["force"] = _from_log10(stiffness, "N", span * nominal_length)
    return {"muscle.hysteresis": entries}


def _from_log10(entry: dict[str, Any], unit: str, times: float = 1.0) -> dict[str, Any]:
    plain = {**entry, "value": times * 10.0 ** entry["value"], "unit": unit}
    if "interval95" in entry:
        plain["interval95"] = [times * 10.0 ** min(end, 300.0) for end in entry["interval95"]]
    return plain


def _frequency(t: FloatArray, f: FloatArray) -> float:
    """Angular frequency with the smallest harmonic residual, by ever finer grids [rad/s].

    They begin one line to either side of the highest line of the spectrum, which is nearer.
    """
    length = float(t[-1])
    low, high = 2.0 * np.pi * 0.9 / length, np.pi / float(np.median(np.diff(t))) / 2.0
    if not low < high:
        raise InputError("force record has too few samples to hold a period; sample faster")
    even = np.linspace(0.0, length, t.size)
    lines = 2.0 * np.pi * np.fft.rfftfreq(t.size, even[1])
    lines = lines[lines <= high]
    sizes = np.abs(np.fft.rfft(np.interp(even, t, f) - np.mean(f)))[1 : lines.size]
    peak, line = float(lines[1 + int(np.argmax(sizes))]), float(lines[1])
    grid = np.linspace(max(peak - line, low), peak + line, 41)
    best = low
    for _ in range(5):
        misses = [_harmonic(t, f, float(w))[1] for w in grid]
        best, step = float(grid[int(np.argmin(misses))]), float(grid[1] - grid[0])
        grid = np.linspace(max(best - step, low), best + step, 21)
    if best <= low * 1.0001:
        raise InputError("force record holds less than one period; record longer")
    return best


def _harmonic(t: FloatArray, y: FloatArray, frequency: float) -> tuple[complex, float]:
    """First harmonic as complex amplitude of sin, and the share of variation it leaves."""
    basis = np.stack([np.ones_like(t), np.sin(frequency * t), np.cos(frequency * t)], axis=1)
    coefficients = np.linalg.lstsq(basis, y, rcond=None)[0]
    rest, spread = y - basis @ coefficients, y - np.mean(y)
    size = float(np.linalg.norm(spread))
    if size == 0.0:
        raise InputError("force or displacement is constant; give a record of a loop")
    share = float(np.linalg.norm(rest)) / size
    return complex(coefficients[1], coefficients[2]), share
