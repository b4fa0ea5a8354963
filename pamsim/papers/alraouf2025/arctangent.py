"""The arctangent model: equations (1) to (4), Table 1, fits to the means of Table 2."""

from __future__ import annotations

import math

from pamsim.papers.alraouf2025.loop import (
    arctangent_half_intervals,
    branch_data,
    fit_arctangent,
    loop_coefficients,
    loop_scores,
    published,
    scores,
)
from pamsim.papers.claim import Order, Recomputed, recomputes
from pamsim.papers.rounding import propagated, propagated_each
from pamsim.recordings.printed import Printed, arctangent_law, loop_equation


@recomputes("alraouf2025-01")
def _product_sign() -> Recomputed:
    b0, b1, b2, b3 = published("down")
    pressure, length = branch_data("down")
    product = scores(arctangent_law(pressure, b0, b1, b2, b3) - length, length)["RMSE"]
    added = arctangent_law(pressure, 1.0, b1, b2, b3) + b0
    total = scores(added - length, length)["RMSE"]
    return Recomputed((total, product), order=Order.RISING)


@recomputes("alraouf2025-02", "up")
@recomputes("alraouf2025-03", "down")
def _same_estimates(branch: str) -> Recomputed:
    return Recomputed([row.estimate for row in loop_coefficients(branch)])


@recomputes("alraouf2025-04", "up")
@recomputes("alraouf2025-05", "down")
def _coefficients(branch: str) -> Recomputed:
    result = fit_arctangent(branch)
    pressure, length = branch_data(branch)
    mse = scores(arctangent_law(pressure, *result) - length, length)["MSE"]
    return Recomputed(result, mse=mse)


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
    pressure, length = branch_data(branch)
    result = fit_arctangent(branch)
    mse = scores(arctangent_law(pressure, *result) - length, length)["MSE"]
    half = float(arctangent_half_intervals(pressure, result, mse)[index])
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
