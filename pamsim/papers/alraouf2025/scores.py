"""Alraouf 2025, Tables 3 and 4: scores of the arctangent and the Bouc-Wen model, compared."""

from __future__ import annotations

import math

import numpy as np

from pamsim.papers.alraouf2025.loop import (
    ARCTANGENT_PARAMETERS,
    BOUC_WEN_PARAMETERS,
    SCORES,
    branch_data,
    fit_arctangent,
    fit_bouc_wen,
    loop_scores,
    measured_width,
    published,
    scores,
)
from pamsim.papers.claim import Recomputed, half_unit, recomputes
from pamsim.signals.static_law import arctangent_law
from pamsim.store.printed import BRANCHES


def _published_scores(branch: str) -> dict[str, float]:
    pressure, length = branch_data(branch)
    return scores(arctangent_law(pressure, *published(branch)) - length, length)


def _fitted_scores(branch: str) -> dict[str, float]:
    pressure, length = branch_data(branch)
    return scores(arctangent_law(pressure, *fit_arctangent(branch)) - length, length)


@recomputes("alraouf2025-16", "up", "MSE")
@recomputes("alraouf2025-17", "up", "R2")
@recomputes("alraouf2025-18", "up", "RMSE")
@recomputes("alraouf2025-19", "up", "MAE")
@recomputes("alraouf2025-20", "down", "MSE")
@recomputes("alraouf2025-21", "down", "R2")
@recomputes("alraouf2025-22", "down", "RMSE")
@recomputes("alraouf2025-23", "down", "MAE")
def _on_table(branch: str, score: str) -> Recomputed:
    printed = loop_scores(branch, "arctangent")[score]
    return Recomputed(
        _published_scores(branch)[score], printed=printed, fitted=_fitted_scores(branch)[score]
    )


@recomputes("alraouf2025-24", "up")
@recomputes("alraouf2025-25", "down")
def _within_reach(branch: str) -> Recomputed:
    printed = loop_scores(branch, "arctangent")["MSE"]
    best = _fitted_scores(branch)["MSE"]
    return Recomputed(
        best,
        holds=best <= printed.value + printed.half_unit,
        tolerance=printed.half_unit,
        printed=printed.value,
    )


@recomputes("alraouf2025-26", "up")
@recomputes("alraouf2025-27", "down")
def _root(branch: str) -> Recomputed:
    models = [loop_scores(branch, name) for name in ("arctangent", "bouc_wen")]
    return Recomputed(
        [math.sqrt(model["MSE"].value) for model in models],
        tolerance=[
            model["RMSE"].half_unit + model["MSE"].half_unit / (2.0 * model["RMSE"].value)
            for model in models
        ],
        printed=[model["RMSE"].value for model in models],
    )


def _implied_variance(branch: str, model: str) -> tuple[float, float]:
    """Variance of the scored lengths, MSE / (1 - R2), and its rounding error [cm^2]."""
    printed = loop_scores(branch, model)
    mse, r2 = printed["MSE"], printed["R2"]
    value = mse.value / (1.0 - r2.value)
    return value, value * (mse.half_unit / mse.value + r2.half_unit / (1.0 - r2.value))


@recomputes("alraouf2025-28", "up")
@recomputes("alraouf2025-29", "down")
def _variance_agrees(branch: str) -> Recomputed:
    arctangent, rounding = _implied_variance(branch, "arctangent")
    bouc_wen, finer = _implied_variance(branch, "bouc_wen")
    return Recomputed(bouc_wen, tolerance=rounding + finer, printed=arctangent)


@recomputes("alraouf2025-30", "up")
@recomputes("alraouf2025-31", "down")
def _variance_of_table(branch: str) -> Recomputed:
    variance, rounding = _implied_variance(branch, "bouc_wen")
    _, length = branch_data(branch)
    return Recomputed(
        float(np.var(length)),
        tolerance=rounding + 2.0 * half_unit(3) * float(np.std(length)),
        printed=variance,
    )


@recomputes("alraouf2025-32", "up")
@recomputes("alraouf2025-33", "down")
def _bouc_wen_scores(branch: str) -> Recomputed:
    printed = loop_scores(branch, "bouc_wen")
    _, length = branch_data(branch)
    loop = fit_bouc_wen()
    result = scores(loop.residual[branch], length)
    return Recomputed(
        [result[score] for score in SCORES], printed=[printed[score] for score in SCORES]
    )


@recomputes("alraouf2025-34", "up")
@recomputes("alraouf2025-35", "down")
def _bouc_wen_better(branch: str) -> Recomputed:
    printed = [loop_scores(branch, name)["MSE"].value for name in ("bouc_wen", "arctangent")]
    _, length = branch_data(branch)
    result = scores(fit_bouc_wen().residual[branch], length)["MSE"]
    arctangent = _fitted_scores(branch)["MSE"]
    return Recomputed(
        result / arctangent,
        holds=result <= arctangent,
        printed=printed[0] / printed[1],
        result=result,
        arctangent_parameters=ARCTANGENT_PARAMETERS,
        arctangent=arctangent,
        fall=100.0 * (1.0 - printed[0] / printed[1]),
    )


@recomputes("alraouf2025-36", "arctangent")
@recomputes("alraouf2025-37", "bouc_wen")
def _rounded(model: str) -> Recomputed:
    values = [loop_scores(branch, model)["R2"].value for branch in BRANCHES]
    return Recomputed(sum(values) / len(values), up=values[0], down=values[1])


@recomputes("alraouf2025-38")
def _fewer_parameters() -> Recomputed:
    arctangent = 2 * ARCTANGENT_PARAMETERS
    return Recomputed(
        (float(arctangent), float(BOUC_WEN_PARAMETERS)), holds=arctangent < BOUC_WEN_PARAMETERS
    )


@recomputes("alraouf2025-39")
def _models_hysteresis() -> Recomputed:
    loop = fit_bouc_wen()
    width = measured_width()
    return Recomputed(
        loop.width,
        holds=loop.width >= 0.5 * width,
        tolerance=0.5 * width,
        printed=width,
        sigma=loop.sigma,
        sharpness=loop.sharpness,
        travel=loop.travel,
    )


@recomputes("alraouf2025-40")
def _passive() -> Recomputed:
    loop = fit_bouc_wen(0.5)
    result = [scores(loop.residual[b], branch_data(b)[1])["MSE"] for b in BRANCHES]
    arctangent = [_fitted_scores(branch)["MSE"] for branch in BRANCHES]
    good = all(a <= b for a, b in zip(result, arctangent, strict=True))
    return Recomputed(
        (result[0], result[1]),
        holds=good,
        printed=tuple(loop_scores(branch, "bouc_wen")["MSE"].value for branch in BRANCHES),
        width=loop.width,
        up=arctangent[0],
        down=arctangent[1],
    )
