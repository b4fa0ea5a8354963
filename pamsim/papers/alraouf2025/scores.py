"""Alraouf 2025: the arctangent model, (1) to (4) and Table 1, and both models' Tables 3 and 4."""

from __future__ import annotations

import math

import numpy as np

from pamsim.papers.alraouf2025.loop import (
    ARCTANGENT_PARAMETERS,
    BOUC_WEN_PARAMETERS,
    SCORES,
    arctangent_half_intervals,
    arctangent_residual,
    arctangent_scores,
    branch_data,
    fit_arctangent,
    fit_bouc_wen,
    loop_coefficients,
    loop_scores,
    measured_gap,
    published,
    scores,
)
from pamsim.papers.claim import Order, Recomputed, recomputes
from pamsim.papers.numerics import half_unit, propagated, propagated_each
from pamsim.recordings.printed import BRANCHES, Printed, loop_equation, loop_rows


@recomputes("alraouf2025-01")
def _product_sign() -> Recomputed:
    b0, *rest = published("down")
    product = arctangent_scores("down", (b0, *rest))["RMSE"]
    added = arctangent_residual("down", (1.0, *rest)) + b0
    total = scores(added, branch_data("down")[1])["RMSE"]
    return Recomputed((total, product), order=Order.RISING)


@recomputes("alraouf2025-02", "up")
@recomputes("alraouf2025-03", "down")
def _same_estimates(branch: str) -> Recomputed:
    return Recomputed([row.estimate for row in loop_coefficients(branch)])


def _fitted_scores(branch: str) -> dict[str, float]:
    return arctangent_scores(branch, fit_arctangent(branch))


@recomputes("alraouf2025-04", "up")
@recomputes("alraouf2025-05", "down")
def _coefficients(branch: str) -> Recomputed:
    return Recomputed(fit_arctangent(branch), mse=_fitted_scores(branch)["MSE"])


@recomputes("alraouf2025-06", "up")
@recomputes("alraouf2025-07", "down")
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


@recomputes("alraouf2025-08", "up", 0)
@recomputes("alraouf2025-09", "up", 1)
@recomputes("alraouf2025-10", "up", 2)
@recomputes("alraouf2025-11", "up", 3)
@recomputes("alraouf2025-12", "down", 0)
@recomputes("alraouf2025-13", "down", 1)
@recomputes("alraouf2025-14", "down", 2)
@recomputes("alraouf2025-15", "down", 3)
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


@recomputes("alraouf2025-16", "up", "MSE")
@recomputes("alraouf2025-17", "up", "R2")
@recomputes("alraouf2025-18", "up", "RMSE")
@recomputes("alraouf2025-19", "up", "MAE")
@recomputes("alraouf2025-20", "down", "MSE")
@recomputes("alraouf2025-21", "down", "R2")
@recomputes("alraouf2025-22", "down", "RMSE")
@recomputes("alraouf2025-23", "down", "MAE")
def _on_table(branch: str, score: str) -> Recomputed:
    return Recomputed(
        propagated(lambda *a: arctangent_scores(branch, a)[score], *loop_equation(branch)),
        printed=loop_scores(branch, "arctangent")[score],
        fitted=_fitted_scores(branch)[score],
    )


@recomputes("alraouf2025-24", "up")
@recomputes("alraouf2025-25", "down")
def _within_reach(branch: str) -> Recomputed:
    printed = loop_scores(branch, "arctangent")["MSE"]
    return Recomputed(_fitted_scores(branch)["MSE"], printed=printed, high=printed)


@recomputes("alraouf2025-26", "up")
@recomputes("alraouf2025-27", "down")
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


@recomputes("alraouf2025-28", "up")
@recomputes("alraouf2025-29", "down")
def _variance_agrees(branch: str) -> Recomputed:
    return Recomputed(
        _implied_variance(branch, "bouc_wen"), printed=_implied_variance(branch, "arctangent")
    )


@recomputes("alraouf2025-30", "up")
@recomputes("alraouf2025-31", "down")
def _variance_of_table(branch: str) -> Recomputed:
    # The table drops trailing zeros: all its numbers have three decimals.
    means = [Printed(row.mean.value, half_unit(3)) for row in loop_rows(branch)]
    return Recomputed(
        propagated(lambda *lengths: float(np.var(lengths)), *means),
        printed=_implied_variance(branch, "bouc_wen"),
    )


@recomputes("alraouf2025-32", "up")
@recomputes("alraouf2025-33", "down")
def _bouc_wen_scores(branch: str) -> Recomputed:
    printed = loop_scores(branch, "bouc_wen")
    result = scores(fit_bouc_wen().residual[branch], branch_data(branch)[1])
    return Recomputed(
        [result[score] for score in SCORES], printed=[printed[score] for score in SCORES]
    )


@recomputes("alraouf2025-34", "up")
@recomputes("alraouf2025-35", "down")
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


@recomputes("alraouf2025-36", "arctangent")
@recomputes("alraouf2025-37", "bouc_wen")
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
