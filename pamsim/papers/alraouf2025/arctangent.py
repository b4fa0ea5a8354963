"""The arctangent model: equations (1) to (4), Table 1, fits to the means of Table 2."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pamsim.papers.claim import Claim, Verdict, compare, holds
from pamsim.papers.loop_fits import (
    arctangent_half_intervals,
    branch_data,
    fit_arctangent,
    scores,
)
from pamsim.signals.static_law import arctangent_law
from pamsim.store.printed_loop import (
    BRANCHES,
    LoopCoefficient,
    loop_coefficients,
    loop_equation,
    loop_scores,
)

FloatArray = NDArray[np.float64]

_NAME = {"up": "(3), pressure rising", "down": "(4), pressure falling"}
_UNITS = ("cm", "1/kPa", "1", "cm")


def claims() -> list[Claim]:
    """Claims B-01 to B-15."""
    first = [_product_sign()]
    for number, branch in enumerate(BRANCHES):
        first += [
            _same_estimates(f"B-{2 + number:02d}", branch),
            _coefficients(f"B-{4 + number:02d}", branch),
            _own_intervals(f"B-{6 + number:02d}", branch),
        ]
    for number, branch in enumerate(BRANCHES):
        for index, row in enumerate(loop_coefficients(branch)):
            first.append(_interval(f"B-{8 + 4 * number + index:02d}", branch, index, row))
    return sorted(first, key=lambda claim: claim.id)


def published(branch: str) -> tuple[float, float, float, float]:
    """Coefficients of (3) or (4)."""
    a0, a1, a2, a3 = (number.value for number in loop_equation(branch))
    return a0, a1, a2, a3


def _product_sign() -> Claim:
    b0, b1, b2, b3 = published("down")
    pressure, length = branch_data("down")
    product = scores(arctangent_law(pressure, b0, b1, b2, b3) - length, length)["RMSE"]
    added = arctangent_law(pressure, 1.0, b1, b2, b3) + b0
    total = scores(added - length, length)["RMSE"]
    return Claim(
        id="B-01",
        what="(2): y_dec = b0 + arctan(b1 p + b2) + b3",
        printed="b0 + arctan(b1 p + b2) + b3",
        recomputed="b0 arctan(b1 p + b2) + b3",
        unit="",
        verdict=holds(total <= product, Verdict.INCONSISTENT),
        reason=f"with the coefficients of (4) the sum misses Table 2 by {total:.2f} cm RMS, the"
        f" product by {product:.2f} cm; (1) and (4) have the product",
    )


def _same_estimates(id: str, branch: str) -> Claim:
    rows = loop_coefficients(branch)
    return compare(
        id,
        f"{_NAME[branch]}: its coefficients are the estimates of Table 1",
        [number.value for number in loop_equation(branch)],
        [row.estimate.value for row in rows],
        [
            max(number.half_unit, row.estimate.half_unit)
            for number, row in zip(loop_equation(branch), rows, strict=True)
        ],
        unit=", ".join(_UNITS),
        reason="digit by digit, to the shorter of the two; tolerance half a unit of its last digit",
        otherwise=Verdict.INCONSISTENT,
    )


def _coefficients(id: str, branch: str) -> Claim:
    found = fit_arctangent(branch)
    pressure, length = branch_data(branch)
    mse = scores(arctangent_law(pressure, *found) - length, length)["MSE"]
    return compare(
        id,
        f"{_NAME[branch]}: a0, a1, a2, a3 by nonlinear least squares",
        published(branch),
        found,
        [number.half_unit for number in loop_equation(branch)],
        unit=", ".join(_UNITS),
        reason=f"least squares on the 11 means of Table 2, best of several starts, MSE {mse:.5f}"
        " cm^2; the means are printed to 0.0005 cm, which moves no digit that differs",
    )


def _own_intervals(id: str, branch: str) -> Claim:
    """Do interval, coefficients, MSE and pressures of the paper belong to one another?"""
    pressure, _ = branch_data(branch)
    printed = loop_equation(branch)
    mse = loop_scores(branch, "arctangent")["MSE"]
    coefficients = published(branch)
    found = arctangent_half_intervals(pressure, coefficients, mse.value)
    rows = loop_coefficients(branch)
    told = [0.5 * (row.high.value - row.low.value) for row in rows]
    rounding = 0.5 * (found / mse.value) * mse.half_unit
    for index, number in enumerate(printed):
        moved = list(coefficients)
        moved[index] += number.half_unit
        rounding += np.abs(arctangent_half_intervals(pressure, tuple(moved), mse.value) - found)
    ends = [0.5 * (_five_digits(row.low.value) + _five_digits(row.high.value)) for row in rows]
    return compare(
        id,
        f"Table 1, {branch}: half widths of the 95 % intervals follow from the printed MSE",
        told,
        [float(value) for value in found],
        [float(a + b) for a, b in zip(ends, rounding, strict=True)],
        unit=", ".join(_UNITS),
        reason="linearised intervals at the printed coefficients, from the printed MSE and 11"
        " pressures 0 to 500 kPa, Student's t with 7 degrees of freedom; tolerance: five printed"
        " digits and the rounding of what went in. So the printed fit is sound and had one length"
        " per pressure, but these lengths were not those of Table 2",
        otherwise=Verdict.INCONSISTENT,
    )


def _interval(id: str, branch: str, index: int, row: LoopCoefficient) -> Claim:
    pressure, length = branch_data(branch)
    found = fit_arctangent(branch)
    mse = scores(arctangent_law(pressure, *found) - length, length)["MSE"]
    half = float(arctangent_half_intervals(pressure, found, mse)[index])
    inside = row.low.value <= found[index] <= row.high.value
    return compare(
        id,
        f"Table 1, {branch}: 95 % interval of {row.symbol}",
        (row.low.value, row.high.value),
        (found[index] - half, found[index] + half),
        (_five_digits(row.low.value), _five_digits(row.high.value)),
        unit=_UNITS[index],
        reason="linearised interval of our least squares on Table 2's means, 7 degrees of freedom;"
        f" our estimate {found[index]:.5g} lies {'inside' if inside else 'outside'} the printed"
        " interval; tolerance half a unit of the fifth digit",
    )


def _five_digits(value: float) -> float:
    """Half a unit of the last digit of Table 1: five digits padded with zeros, six decimals."""
    return max(0.5 * 10.0 ** (math.floor(math.log10(abs(value))) - 4), 0.5e-6)
