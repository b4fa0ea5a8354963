"""Section II: force function (1), (2) of a pleated muscle, and the imposed force."""

from __future__ import annotations

import numpy as np

from pamsim.papers.claim import AGREES, Order, Recomputed, printed_number, recomputes
from pamsim.papers.numerics import root
from pamsim.papers.rounding import propagated, propagated_each
from pamsim.papers.vandamme2008.force_function_fit import fit_pleated, worst_relative_error
from pamsim.papers.vandamme2008.numbers import (
    PERCENT,
    largest,
    length,
    pressures,
    value,
)
from pamsim.physics.force_laws.pleated import (
    pleated_function,
    pleated_max_contraction,
    pleated_shape_function,
)


def _span() -> tuple[float, float]:
    """Contractions in which (2) is used [-]."""
    return value("valid_from") * PERCENT, largest()


@recomputes("vandamme2008-01")
def _possible() -> Recomputed:
    slenderness = value("slenderness")
    return Recomputed(
        pleated_max_contraction(slenderness) / PERCENT,
        low=value("possible_contraction"),
        slender=pleated_max_contraction(1000.0) / PERCENT,
        stout=pleated_max_contraction(2.0) / PERCENT,
    )


@recomputes("vandamme2008-02")
def _pressure_scaling() -> Recomputed:
    slenderness = value("slenderness")
    spread = 0.0
    for eps in np.linspace(*_span(), 13).tolist():
        force = [p * length() ** 2 * pleated_shape_function(eps, slenderness) for p in pressures()]
        scaled = [f / (p * length() ** 2) for f, p in zip(force, pressures(), strict=True)]
        spread = max(spread, max(scaled) / min(scaled) - 1.0)
    return Recomputed(spread, high=AGREES)


@recomputes("vandamme2008-03")
def _polynomial() -> Recomputed:
    slenderness = printed_number("vandamme2008", "slenderness")
    law = fit_pleated(slenderness.value, _span())
    # What half a unit of the printed slenderness moves the shape, where it moves it least.
    rounding = min(
        propagated(lambda s, eps=eps: pleated_shape_function(eps, s), slenderness).half_unit
        / pleated_shape_function(eps, slenderness.value)
        for eps in np.linspace(*_span(), 13).tolist()
    )
    return Recomputed(
        worst_relative_error(law, slenderness.value, _span()) / PERCENT, high=rounding / PERCENT
    )


@recomputes("vandamme2008-04")
def _coefficients() -> Recomputed:
    law = fit_pleated(value("slenderness"), _span())
    return Recomputed((law.f0, law.f1, law.f2, law.f3, law.f4))


@recomputes("vandamme2008-05")
def _muscle_like() -> Recomputed:
    slenderness = value("slenderness")
    ends = [pleated_shape_function(eps, slenderness) for eps in _span()]
    return Recomputed(tuple(ends), low=0.0, order=Order.FALLING, factor=ends[0] / ends[1])


@recomputes("vandamme2008-06")
def _below_five_percent() -> Recomputed:
    slenderness, eps = value("slenderness"), 0.2 * value("valid_from") * PERCENT
    law = fit_pleated(slenderness, _span())
    polynomial = pleated_function(eps, law.f0, law.f1, law.f2, law.f3, law.f4)
    return Recomputed((polynomial / pleated_shape_function(eps, slenderness) - 1.0) / PERCENT)


@recomputes("vandamme2008-07")
def _imposed_force() -> Recomputed:
    names = ("force_amplitude", "force_offset")
    amplitude, offset = (printed_number("vandamme2008", name) for name in names)
    ends = propagated_each(lambda a, b: (b - a, b + a), amplitude, offset)
    return Recomputed(
        ends,
        low=0.0,
        low_half=offset.value - amplitude.value / 2.0,
        high_half=offset.value + amplitude.value / 2.0,
    )


def _contraction_at(scaled: float) -> float:
    slenderness = value("slenderness")
    return root(lambda eps: pleated_shape_function(eps, slenderness) - scaled, 1e-5, 0.45, 1e-12)


@recomputes("vandamme2008-08")
def _contractions_reached() -> Recomputed:
    lowest = value("force_offset") - value("force_amplitude") / 2.0
    result = [_contraction_at(lowest / (p * length() ** 2)) / PERCENT for p in pressures()]
    exchanged = value("force_amplitude") - value("force_offset")
    at_most = _contraction_at(exchanged / (max(pressures()) * length() ** 2)) / PERCENT
    return Recomputed(tuple(result), lowest=lowest, at_most=at_most)
