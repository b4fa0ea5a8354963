"""The arctangent model: equations (1) to (4), Table 1, fits to the means of Table 2."""

from __future__ import annotations

import math

import numpy as np

from pamsim.papers.alraouf2025.loop import (
    arctangent_half_intervals,
    branch_data,
    fit_arctangent,
    loop_coefficients,
    loop_scores,
    published,
    scores,
)
from pamsim.papers.claim import Recomputed, recomputes
from pamsim.signals.static_law import arctangent_law
from pamsim.store.printed import loop_equation


@recomputes("alraouf2025-01")
def _product_sign() -> Recomputed:
    b0, b1, b2, b3 = published("down")
    pressure, length = branch_data("down")
    product = scores(arctangent_law(pressure, b0, b1, b2, b3) - length, length)["RMSE"]
    added = arctangent_law(pressure, 1.0, b1, b2, b3) + b0
    total = scores(added - length, length)["RMSE"]
    return Recomputed(
        "b0 arctan(b1 p + b2) + b3", holds=total <= product, total=total, product=product
    )


@recomputes("alraouf2025-02", "up")
@recomputes("alraouf2025-03", "down")
def _same_estimates(branch: str) -> Recomputed:
    rows = loop_coefficients(branch)
    return Recomputed(
        [row.estimate.value for row in rows],
        tolerance=[
            max(number.half_unit, row.estimate.half_unit)
            for number, row in zip(loop_equation(branch), rows, strict=True)
        ],
    )


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
    printed = loop_equation(branch)
    mse = loop_scores(branch, "arctangent")["MSE"]
    coefficients = published(branch)
    result = arctangent_half_intervals(pressure, coefficients, mse.value)
    rows = loop_coefficients(branch)
    half_widths = [0.5 * (row.high.value - row.low.value) for row in rows]
    rounding = 0.5 * (result / mse.value) * mse.half_unit
    for index, number in enumerate(printed):
        moved = list(coefficients)
        moved[index] += number.half_unit
        rounding += np.abs(arctangent_half_intervals(pressure, tuple(moved), mse.value) - result)
    ends = [0.5 * (_five_digits(row.low.value) + _five_digits(row.high.value)) for row in rows]
    return Recomputed(
        [float(value) for value in result],
        tolerance=[float(a + b) for a, b in zip(ends, rounding, strict=True)],
        printed=half_widths,
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
        tolerance=(_five_digits(row.low.value), _five_digits(row.high.value)),
        printed=(row.low.value, row.high.value),
        estimate=result[index],
        where="inside" if inside else "outside",
    )


def _five_digits(value: float) -> float:
    """Half a unit of the last digit of Table 1: five digits padded with zeros, six decimals."""
    return max(0.5 * 10.0 ** (math.floor(math.log10(abs(value))) - 4), 0.5e-6)
