"""Section II: force function (1), (2) of a pleated muscle, and the imposed force."""

from __future__ import annotations

import numpy as np

from pamsim.muscles.pleated import pleated_function
from pamsim.muscles.pleated_shape import pleated_max_contraction, pleated_shape_function
from pamsim.papers.claim import Recomputed, printed_values, recomputes
from pamsim.papers.numerics import root
from pamsim.papers.vandamme2008.force_function_fit import fit_pleated, worst_relative_error
from pamsim.papers.vandamme2008.numbers import (
    PERCENT,
    largest,
    length,
    pressures,
    value,
)

_CLOSE = 1.0
"""Largest relative deviation that counts as a good approximation [%]."""


@recomputes("vandamme2008-01")
def _possible() -> Recomputed:
    slenderness = value("slenderness")
    result = pleated_max_contraction(slenderness) / PERCENT
    return Recomputed(
        result,
        holds=result > value("possible_contraction"),
        slender=pleated_max_contraction(1000.0) / PERCENT,
        stout=pleated_max_contraction(2.0) / PERCENT,
    )


@recomputes("vandamme2008-02")
def _pressure_scaling() -> Recomputed:
    slenderness, low = value("slenderness"), value("valid_from") * PERCENT
    spread = 0.0
    for eps in np.linspace(low, largest(), 13).tolist():
        force = [p * length() ** 2 * pleated_shape_function(eps, slenderness) for p in pressures()]
        scaled = [f / (p * length() ** 2) for f, p in zip(force, pressures(), strict=True)]
        spread = max(spread, max(scaled) / min(scaled) - 1.0)
    return Recomputed(spread)


@recomputes("vandamme2008-03")
def _polynomial() -> Recomputed:
    slenderness = value("slenderness")
    law = fit_pleated(slenderness, (value("valid_from") * PERCENT, largest()))
    span = (value("valid_from") * PERCENT, largest())
    result = worst_relative_error(law, slenderness, span) / PERCENT
    return Recomputed(result, holds=result <= _CLOSE, close=_CLOSE)


@recomputes("vandamme2008-04")
def _coefficients() -> Recomputed:
    law = fit_pleated(value("slenderness"), (value("valid_from") * PERCENT, largest()))
    return Recomputed((law.f0, law.f1, law.f2, law.f3, law.f4))


@recomputes("vandamme2008-05")
def _muscle_like() -> Recomputed:
    slenderness = value("slenderness")
    ends = [
        pleated_shape_function(eps, slenderness)
        for eps in (value("valid_from") * PERCENT, largest())
    ]
    return Recomputed(tuple(ends), holds=ends[0] > 10.0 * ends[1] > 0.0, factor=ends[0] / ends[1])


@recomputes("vandamme2008-06")
def _below_five_percent() -> Recomputed:
    slenderness, eps = value("slenderness"), 0.2 * value("valid_from") * PERCENT
    law = fit_pleated(slenderness, (value("valid_from") * PERCENT, largest()))
    polynomial = pleated_function(eps, law.f0, law.f1, law.f2, law.f3, law.f4)
    result = (polynomial / pleated_shape_function(eps, slenderness) - 1.0) / PERCENT
    return Recomputed(result, holds=result > _CLOSE)


@recomputes("vandamme2008-07")
def _imposed_force() -> Recomputed:
    amplitude, offset = value("force_amplitude"), value("force_offset")
    lowest = offset - amplitude
    return Recomputed(
        (lowest, offset + amplitude),
        holds=lowest >= 0.0,
        low=offset - amplitude / 2.0,
        high=offset + amplitude / 2.0,
    )


def _contraction_at(scaled: float) -> float:
    slenderness = value("slenderness")
    return root(lambda eps: pleated_shape_function(eps, slenderness) - scaled, 1e-5, 0.45, 1e-12)


@recomputes("vandamme2008-08")
def _contractions_reached() -> Recomputed:
    lowest = value("force_offset") - value("force_amplitude") / 2.0
    result = [_contraction_at(lowest / (p * length() ** 2)) / PERCENT for p in pressures()]
    printed = value("max_contraction")
    exchanged = value("force_amplitude") - value("force_offset")
    at_most = _contraction_at(exchanged / (max(pressures()) * length() ** 2)) / PERCENT
    return Recomputed(
        tuple(result),
        holds=min(result) <= printed <= max(result),
        lowest=lowest,
        at_most=at_most,
    )


@recomputes("vandamme2008-09")
def _fibres() -> Recomputed:
    return Recomputed(
        None, pressures=", ".join(f"{p:g}" for p in printed_values("vandamme2008", "pressures"))
    )
