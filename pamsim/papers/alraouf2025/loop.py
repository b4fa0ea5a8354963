"""The printed pressure-length loop, and fits to it: arctangent branches, a static Bouc-Wen loop.

Lengths in cm and pressures in kPa, as printed.

Arctangent: y = a0 arctan(a1 p + a2) + a3 for each branch, 4 + 4 parameters.
Bouc-Wen: y = c0 + c1 p + c2 z for both branches, with dz/dp = (1 - |z|^n (sigma sign(z dp) + 1 -
sigma)) / D followed from z0 at 0 kPa up and down again, 7 parameters: c0, c1, c2, D, sigma, n, z0.
At sigma = 0 it has no memory: both branches are one curve. From sigma = 1/2 on it is the passive
hysteresis of `pamsim.physics.hysteresis`.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.special import stdtrit

from pamsim.core.units import FloatArray
from pamsim.inference.bounded_least_squares import bounded_least_squares
from pamsim.papers.numerics import (
    jacobian,
    least_squares,
)
from pamsim.recordings.printed import (
    Printed,
    arctangent_law,
    loop_equation,
    loop_rows,
    printed_table,
)

SCORES = ("MSE", "R2", "RMSE", "MAE")
"""Printed measures of fit, in the order of the tables."""

ARCTANGENT_PARAMETERS = 4
"""Of one branch."""

BOUC_WEN_PARAMETERS = 7
"""Of both branches together."""

_ARCTANGENT_STARTS = (
    (2.5, -0.01, 1.5, 27.8),
    (2.0, -0.02, 3.0, 27.0),
    (4.0, -0.005, 0.5, 28.0),
    (1.5, -0.03, 4.0, 27.0),
)
_ARCTANGENT_SCALE = (1.0, 0.01, 1.0, 10.0)
# sigma is held at each of these in turn and the best is kept: near 0 the fit is flat in sigma, and
# a solver that may move it stops short.
_SIGMAS = (0.0, 0.1, 0.5, 1.0)
_BOUC_WEN_STARTS = ((75.0, 5.0, 0.001), (300.0, 2.5, 0.001))  # D, n, 1 + z0
_BOUNDS = (np.log([10.0, 1.0, 1e-12]), np.log([2000.0, 20.0, 2.0]))
_CELL = 0.005  # of the grid of |z|, in ln(1 - |z|)
_SIZE = -np.expm1(-_CELL * np.arange(6401))  # from 0 to 1 - 1e-14
_LOG = np.log(np.maximum(_SIZE, 1e-300))


class BoucWenLoop(NamedTuple):
    """A fitted static loop."""

    travel: float  # D [kPa]
    sigma: float  # shape [-]
    sharpness: float  # n [-]
    residual: dict[str, FloatArray]  # branch -> fitted minus mean length, by rising pressure [cm]
    width: float  # largest distance between the branches at one pressure [cm]


class LoopCoefficient(NamedTuple):
    """One coefficient with its 95 % interval (Table 1)."""

    symbol: str
    estimate: Printed
    low: Printed
    high: Printed


def loop_coefficients(branch: str) -> tuple[LoopCoefficient, ...]:
    """The four coefficients of one branch as Table 1 prints them."""
    return tuple(
        LoopCoefficient(row["symbol"], *(Printed.read(row[n]) for n in ("estimate", "low", "high")))
        for row in printed_table("alraouf2025_table1.csv")
        if row["branch"] == branch
    )


def loop_scores(branch: str, model: str) -> Mapping[str, Printed]:
    """Printed `scores` of a branch (Tables 3 and 4), model ``arctangent`` or ``bouc_wen``."""
    rows = printed_table("alraouf2025_scores.csv")
    return {row["score"]: Printed.read(row[model]) for row in rows if row["branch"] == branch}


def published(branch: str) -> tuple[float, ...]:
    """Coefficients of (3) or (4)."""
    return tuple(number.value for number in loop_equation(branch))


def branch_data(branch: str) -> tuple[FloatArray, FloatArray]:
    """Pressures [kPa] and mean lengths [cm] of one branch of Table 2."""
    rows = loop_rows(branch)
    return np.array([row.pressure_kpa for row in rows]), np.array([row.mean.value for row in rows])


def differences() -> list[tuple[Printed, float]]:
    """Up less down mean at each pressure with its rounding, and half its interval [cm].

    The interval is that of the printed ones.
    """
    return [
        (
            Printed(up.mean.value - down.mean.value, up.mean.half_unit + down.mean.half_unit),
            math.hypot(up.half_interval.value, down.half_interval.value),
        )
        for up, down in zip(loop_rows("up"), loop_rows("down"), strict=True)
    ]


def measured_gap() -> tuple[Printed, float]:
    """Largest distance between the branches of Table 2, as in `differences` [cm]."""
    gap, half = max(differences(), key=lambda pair: abs(pair[0].value))
    return Printed(abs(gap.value), gap.half_unit), half


def scores(residual: FloatArray, length: FloatArray) -> dict[str, float]:
    """MSE [cm^2], R2, RMSE and MAE [cm] as MATLAB and the paper count them: means over all rows."""
    mse = float(np.mean(residual**2))
    return {
        "MSE": mse,
        "R2": 1.0 - mse / float(np.var(length)),
        "RMSE": math.sqrt(mse),
        "MAE": float(np.mean(np.abs(residual))),
    }


def arctangent_residual(branch: str, coefficients: Sequence[float] | FloatArray) -> FloatArray:
    """Arctangent of a0..a3 less the means of Table 2 [cm]."""
    pressure, length = branch_data(branch)
    return arctangent_law(pressure, *coefficients) - length


def arctangent_scores(branch: str, coefficients: Sequence[float]) -> dict[str, float]:
    """`scores` of `arctangent_residual`."""
    return scores(arctangent_residual(branch, coefficients), branch_data(branch)[1])


@functools.cache
def fit_arctangent(branch: str) -> tuple[float, float, float, float]:
    """Least squares of one branch on Table 2's means, the best of several fixed starts."""
    pressure, length = branch_data(branch)
    options: dict[str, Any] = dict.fromkeys(("xtol", "ftol", "gtol"), 1e-14)
    options["jac"] = lambda _, *a: _arctangent_jacobian(pressure, a)
    options["x_scale"] = _ARCTANGENT_SCALE
    fits = [
        least_squares(lambda *a: arctangent_law(pressure, *a), length, start, **options)[0]
        for start in _ARCTANGENT_STARTS
    ]
    best = min(fits, key=lambda a: float(np.sum(arctangent_residual(branch, a) ** 2)))
    a0, a1, a2, a3 = (float(a) for a in best)
    # (a0, a1, a2) and (-a0, -a1, -a2) are one curve; the paper's has a0 > 0.
    sign = math.copysign(1.0, a0)
    return sign * a0, sign * a1, sign * a2, a3


def _arctangent_jacobian(pressure: FloatArray, a: tuple[float, ...]) -> FloatArray:
    return jacobian(lambda b: arctangent_law(pressure, *b), a)


def arctangent_half_intervals(
    pressure: FloatArray, coefficients: tuple[float, ...], mse: float
) -> FloatArray:
    """Half the linearised 95 % intervals (4,) of a0..a3, as MATLAB's ``nlparci`` has them.

    They are those at the optimum of a fit at pressures (n,) [kPa], where the mean square of the
    residuals is ``mse`` [cm^2].
    """
    columns = _arctangent_jacobian(pressure, coefficients)
    freedom = len(pressure) - ARCTANGENT_PARAMETERS
    covariance = np.linalg.inv(columns.T @ columns) * mse * len(pressure) / freedom
    return float(stdtrit(freedom, 0.975)) * np.sqrt(np.diag(covariance))


def fit_bouc_wen(lowest_sigma: float = 0.0) -> BoucWenLoop:
    """Least squares of the static Bouc-Wen loop on both branches of Table 2.

    The lower bound of sigma at 0 lets the memory vanish, at 1/2 it keeps the loop passive.
    """
    tries = [_fit_at(sigma) for sigma in _SIGMAS if sigma >= lowest_sigma]
    return min(tries, key=lambda loop: sum(float(r @ r) for r in loop.residual.values()))


@functools.cache
def _fit_at(sigma: float) -> BoucWenLoop:
    pressure, up = branch_data("up")
    length = np.concatenate([up, branch_data("down")[1]])
    line = np.stack([np.ones(len(length)), np.tile(pressure, 2)], axis=1)

    def residual_at(x: FloatArray) -> FloatArray:
        travel, sharpness, start = _natural(x)
        path = _path(travel, sigma, sharpness, start, pressure)
        # The three linear coefficients are solved for, so only D, n and z0 are searched.
        basis = np.column_stack([line, path])
        return basis @ np.linalg.lstsq(basis, length, rcond=None)[0] - length

    best = bounded_least_squares(
        residual_at,
        [np.log(start) for start in _BOUC_WEN_STARTS],
        lower=_BOUNDS[0],
        upper=_BOUNDS[1],
        jacobian="3-point",
        tolerance=1e-9,
    ).x
    residual, half = residual_at(best), len(pressure)
    curve = residual + length
    travel, sharpness, _ = _natural(best)
    return BoucWenLoop(
        travel=travel,
        sigma=sigma,
        sharpness=sharpness,
        residual={"up": residual[:half], "down": residual[half:]},
        width=float(np.max(np.abs(curve[:half] - curve[half:]))),
    )


def _natural(x: FloatArray) -> tuple[float, float, float]:
    """D, n and z0 of the solver's variables, the logarithms of D, n and 1 + z0.

    Near z0 = -1 the loop leaves its corner the later the nearer: there only the logarithm counts.
    """
    travel, sharpness, above = (math.exp(value) for value in x)
    return travel, sharpness, above - 1.0


def _path(
    travel: float, sigma: float, sharpness: float, start: float, pressure: FloatArray
) -> FloatArray:
    """Internal variable at every pressure, up and then down, both by rising pressure.

    dz/dp depends on z alone, so p/D is an integral over z: of 1/(1 - z^n) while |z| grows, of
    1/(1 - (1 - 2 sigma) z^n) while it falls.
    """
    left = -np.expm1(sharpness * _LOG)  # 1 - z^n
    grow, fall = (_travelled(_SIZE, rate) for rate in (left, left + 2.0 * sigma * (1.0 - left)))

    def followed(begin: float, way: FloatArray) -> FloatArray:
        """From z = begin towards 1, a way in units of D."""
        ahead = np.interp(begin, _SIZE, grow) if begin > 0.0 else -np.interp(-begin, _SIZE, fall)
        t = ahead + way
        return np.where(t > 0.0, np.interp(t, grow, _SIZE), -np.interp(-t, fall, _SIZE))

    way = (pressure - pressure[0]) / travel
    up = followed(start, way)
    # Without memory the way down is the way up; followed, it would start from a z rounded to 1.
    down = -followed(-float(up[-1]), way)[::-1] if sigma > 0.0 else up
    return np.concatenate([up, down])


def _travelled(size: FloatArray, rate: FloatArray) -> FloatArray:
    """Integral of dz/rate from 0 to every z of the grid (trapezoidal rule in ln(1 - z))."""
    inside = (1.0 - size) / rate
    return np.concatenate([[0.0], np.cumsum(0.5 * _CELL * (inside[1:] + inside[:-1]))])
