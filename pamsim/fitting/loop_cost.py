"""Cost of a fractional Maxwell model against measured force-displacement loops (Nguyen 2024, (16)).

Under F = F0 sin(w t) the loop passes through (x1, F0) and (x2 < 0, 0). With g = (w beta)^alpha the
model asks there

    (14)  Ke g x1 - (g + cos(alpha pi/2)) F0 = 0,      (15)  Ke g x2 + F0 sin(alpha pi/2) = 0,

and the cost (16) is the sum of their squares over all loops. One loop gives two equations for three
unknowns: loops at two frequencies at least are needed. The unit of Ke follows the displacement's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.inference.coefficient import Coefficient
from pamsim.inference.record_checks import increasing_time

MAXWELL = (
    Coefficient(name="alpha", unit="1", low=0.01, high=0.99),
    Coefficient(name="log10_beta", unit="1", low=-3.0, high=4.0),
    Coefficient(name="log10_stiffness", unit="1", low=1.0, high=7.0),
)
"""What is searched: order [-], relaxation time [s] and stiffness [N/m] by their exponents of ten.

The last two span decades, and any search in their plain values spends itself on the last decade."""


@dataclass(frozen=True, kw_only=True)
class LoopPoints:
    """The points of a loop that the cost uses.

    Attributes:
        frequency: w [rad/s].
        force: amplitude F0 [N].
        at_force: displacement x1 where the force is F0 [m].
        at_zero: displacement x2 where the force passes zero upwards [m], negative.
    """

    frequency: float
    force: float
    at_force: float
    at_zero: float


def loop_points(time: ArrayLike, force: ArrayLike, displacement: ArrayLike) -> LoopPoints:
    """Read w, F0, x1 and x2 off a measured loop.

    The frequency is the one that leaves the smallest harmonic residual in force; x1 and x2 are
    those of the displacement's own first harmonic, counted from its mean, so that noise and
    offsets do not enter.

    Args:
        time: increasing, at least one period, shape (n,) [s].
        force: shape (n,) [N].
        displacement: shape (n,) [m].

    Returns:
        The points.

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
    """Left sides of (14) and (15), whose squares add up to the cost (16).

    Args:
        values: as in `MAXWELL`, shape (3,).
        loops: measured points.

    Returns:
        Residuals [N], shape (2 n,).
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

    Args:
        alpha: [-].
        beta: [s].
        stiffness: Ke [N/m].
        frequency: w [rad/s].
        force: F0 [N].

    Returns:
        The points.
    """
    g, quarter = (frequency * beta) ** alpha, 0.5 * np.pi * alpha
    return LoopPoints(
        frequency=frequency,
        force=force,
        at_force=float((g + np.cos(quarter)) * force / (stiffness * g)),
        at_zero=float(-force * np.sin(quarter) / (stiffness * g)),
    )


def _frequency(t: FloatArray, f: FloatArray) -> float:
    """Angular frequency with the smallest harmonic residual, by ever finer grids [rad/s]."""
    length = float(t[-1])
    low, high = 2.0 * np.pi * 0.9 / length, np.pi / float(np.median(np.diff(t))) / 2.0
    if not low < high:
        raise InputError("force record has too few samples to hold a period; sample faster")
    # First a grid fine enough that none of the record's periods is skipped, then closer round it.
    grid = np.linspace(low, high, min(4000, int(4 * high / low) + 2))
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
