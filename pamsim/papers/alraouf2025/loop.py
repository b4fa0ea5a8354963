"""Alraouf 2025, Tables 1 to 4: the loop, its fits by two models, and claims on them.

Lengths in cm and pressures in kPa, as printed.

Arctangent: y = a0 arctan(a1 p + a2) + a3 for each branch, 4 + 4 parameters.
Bouc-Wen: y = c0 + c1 p + c2 z for both branches, with dz/dp = (1 - |z|^n (sigma sign(z dp) + 1 -
sigma)) / D followed from z0 at 0 kPa up and down again, 7 parameters: c0, c1, c2, D, sigma, n, z0.
At sigma = 0 it has no memory: both branches are one curve. From sigma = 1/2 on it is the passive
hysteresis of `pamsim.physics.hysteresis`.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.special import stdtrit

from pamsim.core.units import FloatArray
from pamsim.inference.bounded_least_squares import bounded_least_squares
from pamsim.papers.claim import Order, Recomputed, recomputes
from pamsim.papers.numerics import (
    PrintedNumbers,
    half_unit,
    jacobian,
    least_squares,
    propagated,
    propagated_each,
)
from pamsim.recordings.printed import (
    BRANCHES,
    LoopRow,
    Printed,
    arctangent_law,
    loop_equation,
    loop_rows,
    printed_document,
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
_RUNS = 3
# The table drops trailing zeros (30.05 beside 30.053): all its numbers have three decimals.
_ROUNDING = half_unit(3)


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


def published(branch: str) -> tuple[float, float, float, float]:
    """Coefficients of (3) or (4)."""
    a0, a1, a2, a3 = (number.value for number in loop_equation(branch))
    return a0, a1, a2, a3


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
    """Least squares with sigma held."""
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


def _ranger() -> Printed:
    """Printed accuracy of the distance sensor [cm]."""
    return Printed(0.1 * PrintedNumbers("alraouf2025", "ranger").value("accuracy"), half_unit(1))


@recomputes("alraouf2025-41", each=BRANCHES)
def _intervals(branch: str) -> Recomputed:
    student = float(stdtrit(_RUNS - 1, 0.975))
    factor = student / math.sqrt(_RUNS)

    def off(row: LoopRow) -> float:
        return abs(row.half_interval.value - factor * row.deviation.value)

    worst = max(loop_rows(branch), key=off)
    return Recomputed(
        Printed(off(worst), _ROUNDING * (1.0 + factor)),
        low=0.0,
        high=0.0,
        student=student,
        pressure=worst.pressure_kpa,
        printed_half=worst.half_interval.value,
        half=factor * worst.deviation.value,
    )


@recomputes("alraouf2025-43", each=BRANCHES)
def _residual_size(branch: str) -> Recomputed:
    residual = np.abs(arctangent_residual(branch, published(branch)))
    limit = Printed(0.3, half_unit(1))
    largest = limit.value + limit.half_unit
    return Recomputed(
        propagated(
            lambda *a: float(np.max(np.abs(arctangent_residual(branch, a)))), *loop_equation(branch)
        ),
        high=limit,
        pressure=branch_data(branch)[0][int(residual.argmax())],
        limit=largest,
        beyond=int(np.sum(residual > largest)),
        rows=len(residual),
    )


@recomputes("alraouf2025-45", each=BRANCHES)
def _residual_order(branch: str) -> Recomputed:
    residual = -arctangent_residual(branch, published(branch))
    centred = residual - residual.mean()
    lag = float(centred[1:] @ centred[:-1] / (centred @ centred))
    limit = 1.96 / math.sqrt(len(residual))
    return Recomputed(lag, low=0.0, high=0.0, scatter=limit, mean=residual.mean(), limit=limit)


def _differences() -> tuple[FloatArray, FloatArray]:
    difference, half = zip(*differences(), strict=True)
    return np.array([number.value for number in difference]), np.array(half)


@recomputes("alraouf2025-47")
def _clear_difference() -> Recomputed:
    difference, half = _differences()
    of_mean = float(np.sqrt(np.sum(half**2))) / len(half)
    return Recomputed(
        float(difference.mean()),
        low=0.0,
        scatter=of_mean,
        half=of_mean,
        clear=int(np.sum(np.abs(difference) > half)),
        pressures=len(difference),
        largest=np.abs(difference).max(),
        ranger=_ranger().value,
    )


@recomputes("alraouf2025-48")
def _delayed() -> Recomputed:
    difference, half = _differences()
    pressure, _ = branch_data("up")
    rising, falling = (arctangent_law(pressure, *published(branch)) for branch in BRANCHES)
    against = [f"{p:.0f}" for p, gap in zip(pressure, difference, strict=True) if gap < 0.0]
    return Recomputed(
        difference.tolist(),
        low=0.0,
        scatter=half.tolist(),
        against=", ".join(against),
        right=int(np.sum(rising > falling)),
        pressures=len(difference),
    )


@recomputes("alraouf2025-49", each=(0, 9))
def _still(index: int) -> Recomputed:
    ends = [loop_rows(branch)[index : index + 2] for branch in BRANCHES]
    change = [second.mean.value - first.mean.value for first, second in ends]
    half = [math.hypot(a.half_interval.value, b.half_interval.value) for a, b in ends]
    least = Printed(-_ranger().value, _ranger().half_unit)
    return Recomputed(change, low=least, high=_ranger(), scatter=half, up=half[0], down=half[1])


@recomputes("alraouf2025-51")
def _low_deviations() -> Recomputed:
    rows = [row for branch in BRANCHES for row in loop_rows(branch)]
    worst = max(rows, key=lambda row: row.deviation.value)
    stroke = max(r.mean.value for r in rows) - min(r.mean.value for r in rows)
    return Recomputed(
        (worst.deviation, worst.half_interval),
        high=_ranger(),
        pressure=worst.pressure_kpa,
        branch=worst.branch,
        share=100.0 * worst.half_interval.value / stroke,
        stroke=stroke,
        exceeding=sum(r.half_interval.value > _ranger().value for r in rows),
        rows=len(rows),
    )


@recomputes("alraouf2025-53")
def _stage_of_table_4() -> Recomputed:
    printed = printed_document("alraouf2025.toml", digits=True)["text_scores"]
    table = loop_scores("down", "arctangent")
    return Recomputed([table[score] for score in SCORES], printed=printed["up"])


@recomputes("alraouf2025-01")
def _product_sign() -> Recomputed:
    b0, *rest = published("down")
    product = arctangent_scores("down", (b0, *rest))["RMSE"]
    added = arctangent_residual("down", (1.0, *rest)) + b0
    total = scores(added, branch_data("down")[1])["RMSE"]
    return Recomputed((total, product), order=Order.RISING)


@recomputes("alraouf2025-02", each=BRANCHES)
def _same_estimates(branch: str) -> list[Printed]:
    return [row.estimate for row in loop_coefficients(branch)]


def _fitted_scores(branch: str) -> dict[str, float]:
    return arctangent_scores(branch, fit_arctangent(branch))


@recomputes("alraouf2025-04", each=BRANCHES)
def _coefficients(branch: str) -> Recomputed:
    return Recomputed(fit_arctangent(branch), mse=_fitted_scores(branch)["MSE"])


@recomputes("alraouf2025-06", each=BRANCHES)
def _own_intervals(branch: str) -> Recomputed:
    """Do interval, coefficients, MSE and pressures of the paper belong to one another?"""
    pressure, _ = branch_data(branch)
    rows = loop_coefficients(branch)

    def half(*numbers: float) -> list[float]:
        return arctangent_half_intervals(pressure, numbers[1:], numbers[0]).tolist()

    return Recomputed(
        propagated_each(half, loop_scores(branch, "arctangent")["MSE"], *loop_equation(branch)),
        printed=[
            propagated(
                lambda low, high: 0.5 * (high - low), _five_digits(row.low), _five_digits(row.high)
            )
            for row in rows
        ],
    )


@recomputes("alraouf2025-08", each=itertools.product(BRANCHES, range(4)))
def _interval(branch: str, index: int) -> Recomputed:
    result, mse = fit_arctangent(branch), _fitted_scores(branch)["MSE"]
    half = float(arctangent_half_intervals(branch_data(branch)[0], result, mse)[index])
    row = loop_coefficients(branch)[index]
    inside = row.low.value <= result[index] <= row.high.value
    return Recomputed(
        (result[index] - half, result[index] + half),
        printed=(_five_digits(row.low), _five_digits(row.high)),
        estimate=result[index],
        where="inside" if inside else "outside",
    )


def _five_digits(number: Printed) -> Printed:
    """A number of Table 1, whose five digits are padded with zeros to six decimals."""
    digit = 0.5 * 10.0 ** (math.floor(math.log10(abs(number.value))) - 4)
    return Printed(number.value, max(digit, number.half_unit))


@recomputes("alraouf2025-16", each=itertools.product(BRANCHES, SCORES))
def _on_table(branch: str, score: str) -> Recomputed:
    return Recomputed(
        propagated(lambda *a: arctangent_scores(branch, a)[score], *loop_equation(branch)),
        printed=loop_scores(branch, "arctangent")[score],
        fitted=_fitted_scores(branch)[score],
    )


@recomputes("alraouf2025-24", each=BRANCHES)
def _within_reach(branch: str) -> Recomputed:
    printed = loop_scores(branch, "arctangent")["MSE"]
    return Recomputed(_fitted_scores(branch)["MSE"], printed=printed, high=printed)


@recomputes("alraouf2025-26", each=BRANCHES)
def _root(branch: str) -> Recomputed:
    models = [loop_scores(branch, name) for name in ("arctangent", "bouc_wen")]
    return Recomputed(
        [propagated(math.sqrt, model["MSE"]) for model in models],
        printed=[model["RMSE"] for model in models],
    )


def _implied_variance(branch: str, model: str) -> Printed:
    """Variance of the scored lengths, MSE / (1 - R2) [cm^2]."""
    printed = loop_scores(branch, model)
    return propagated(lambda mse, r2: mse / (1.0 - r2), printed["MSE"], printed["R2"])


@recomputes("alraouf2025-28", each=BRANCHES)
def _variance_agrees(branch: str) -> Recomputed:
    return Recomputed(
        _implied_variance(branch, "bouc_wen"), printed=_implied_variance(branch, "arctangent")
    )


@recomputes("alraouf2025-30", each=BRANCHES)
def _variance_of_table(branch: str) -> Recomputed:
    # The table drops trailing zeros: all its numbers have three decimals.
    means = [Printed(row.mean.value, half_unit(3)) for row in loop_rows(branch)]
    return Recomputed(
        propagated(lambda *lengths: float(np.var(lengths)), *means),
        printed=_implied_variance(branch, "bouc_wen"),
    )


@recomputes("alraouf2025-32", each=BRANCHES)
def _bouc_wen_scores(branch: str) -> Recomputed:
    printed = loop_scores(branch, "bouc_wen")
    result = scores(fit_bouc_wen().residual[branch], branch_data(branch)[1])
    return Recomputed(
        [result[score] for score in SCORES], printed=[printed[score] for score in SCORES]
    )


@recomputes("alraouf2025-34", each=BRANCHES)
def _bouc_wen_better(branch: str) -> Recomputed:
    ours = fit_bouc_wen().residual[branch]
    arctangent = arctangent_residual(branch, fit_arctangent(branch))
    gain = float(np.mean(arctangent**2 - ours**2))
    # What the printed intervals of the means do to the difference, both fits held.
    interval = np.array([row.half_interval.value for row in loop_rows(branch)])
    half = 2.0 * float(np.sqrt(np.sum(((arctangent - ours) * interval) ** 2))) / len(ours)
    mse = [loop_scores(branch, name)["MSE"] for name in ("arctangent", "bouc_wen")]
    return Recomputed(
        gain,
        printed=propagated(lambda first, second: first - second, *mse),
        low=0.0,
        scatter=half,
        result=float(np.mean(ours**2)),
        arctangent_parameters=ARCTANGENT_PARAMETERS,
        arctangent=float(np.mean(arctangent**2)),
        half=half,
    )


@recomputes("alraouf2025-36", each=("arctangent", "bouc_wen"))
def _rounded(model: str) -> Recomputed:
    both = [loop_scores(branch, model)["R2"] for branch in BRANCHES]
    return Recomputed(
        propagated(lambda up, down: 0.5 * (up + down), *both),
        up=both[0].value,
        down=both[1].value,
    )


@recomputes("alraouf2025-38")
def _fewer_parameters() -> Recomputed:
    return Recomputed((2.0 * ARCTANGENT_PARAMETERS, float(BOUC_WEN_PARAMETERS)), order=Order.RISING)


@recomputes("alraouf2025-39")
def _models_hysteresis() -> Recomputed:
    loop = fit_bouc_wen()
    gap, half = measured_gap()
    return Recomputed(
        loop.width,
        printed=gap,
        scatter=half,
        half=half,
        sigma=loop.sigma,
        sharpness=loop.sharpness,
        travel=loop.travel,
    )


@recomputes("alraouf2025-40")
def _passive() -> Recomputed:
    loop = fit_bouc_wen(0.5)
    result = [scores(loop.residual[b], branch_data(b)[1])["MSE"] for b in BRANCHES]
    return Recomputed(
        result,
        printed=[loop_scores(branch, "bouc_wen")["MSE"] for branch in BRANCHES],
        width=loop.width,
        up=_fitted_scores("up")["MSE"],
        down=_fitted_scores("down")["MSE"],
    )
