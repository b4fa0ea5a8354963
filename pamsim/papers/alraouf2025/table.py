"""Alraouf 2025, Tables 1 to 4: claims on intervals, the loop and both models' scores."""

from __future__ import annotations

import itertools
import math

import numpy as np
from scipy.special import stdtrit

from pamsim.core.units import FloatArray
from pamsim.papers.alraouf2025.loop import (
    ARCTANGENT_PARAMETERS,
    BOUC_WEN_PARAMETERS,
    SCORES,
    arctangent_half_intervals,
    arctangent_residual,
    arctangent_scores,
    branch_data,
    differences,
    fit_arctangent,
    fit_bouc_wen,
    loop_coefficients,
    loop_scores,
    measured_gap,
    published,
    scores,
)
from pamsim.papers.claim import Order, Recomputed, recomputes
from pamsim.papers.numerics import (
    PrintedNumbers,
    half_unit,
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
)

_RUNS = 3
# The table drops trailing zeros (30.05 beside 30.053): all its numbers have three decimals.
_ROUNDING = half_unit(3)


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
