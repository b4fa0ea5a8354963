"""Section II: force function (1), (2) of a pleated muscle, and the imposed force."""

from __future__ import annotations

import numpy as np

from pamsim.muscles.pleated import pleated_function
from pamsim.muscles.pleated_fit import fit_pleated, worst_relative_error
from pamsim.muscles.pleated_shape import pleated_max_contraction, pleated_shape_function
from pamsim.papers.claim import Claim, Verdict, compare, holds
from pamsim.papers.printed_number import printed_values
from pamsim.papers.root import root
from pamsim.papers.vandamme2008.numbers import (
    PERCENT,
    largest,
    length,
    pressures,
    value,
)

_CLOSE = 1.0
"""Largest relative deviation that counts as a good approximation [%]."""


def claims() -> list[Claim]:
    """Claims D-01 to D-09."""
    return [
        _possible(),
        _pressure_scaling(),
        _polynomial(),
        _coefficients(),
        _muscle_like(),
        _below_five_percent(),
        _imposed_force(),
        _contractions_reached(),
        _fibres(),
    ]


def _possible() -> Claim:
    slenderness = value("slenderness")
    found = pleated_max_contraction(slenderness) / PERCENT
    return Claim(
        id="D-01",
        what="contractions of over 40 % are possible, depending on the slenderness; here l0/R = 6",
        printed="over 40 %",
        recomputed=found,
        unit="%",
        verdict=holds(found > value("possible_contraction"), Verdict.INCONSISTENT),
        reason="contraction at which the exact shape for many fibres stops pulling; an infinitely"
        f" slender muscle would reach {pleated_max_contraction(1e3) / PERCENT:.1f} %, l0/R = 2 only"
        f" {pleated_max_contraction(2.0) / PERCENT:.1f} %",
    )


def _pressure_scaling() -> Claim:
    slenderness, low = value("slenderness"), value("valid_from") * PERCENT
    spread = 0.0
    for eps in np.linspace(low, largest(), 13).tolist():
        force = [p * length() ** 2 * pleated_shape_function(eps, slenderness) for p in pressures()]
        scaled = [f / (p * length() ** 2) for f, p in zip(force, pressures(), strict=True)]
        spread = max(spread, max(scaled) / min(scaled) - 1.0)
    return compare(
        "D-02",
        "(1): without membrane elasticity F/(p l0^2) does not depend on the pressure; spread",
        0.0,
        spread,
        1e-12,
        unit="1",
        reason="follows from the model, in which the pressure only scales the fibre tension; 1, 1.5"
        " and 2.5 bar, 5 to 35 %. Whether the measured curves of Figures 5 and 6 agree is not"
        " printed, see D-20",
        otherwise=Verdict.INCONSISTENT,
    )


def _polynomial() -> Claim:
    slenderness = value("slenderness")
    law = fit_pleated(slenderness, (value("valid_from") * PERCENT, largest()))
    span = (value("valid_from") * PERCENT, largest())
    found = worst_relative_error(law, slenderness, span) / PERCENT
    return Claim(
        id="D-03",
        what="(2) approximates f_t0: largest relative deviation from the exact shape, 5 to 35 %",
        printed="approximated by a function of the form (2)",
        recomputed=found,
        unit="%",
        verdict=holds(found <= _CLOSE, Verdict.INCONSISTENT),
        reason="five coefficients fitted to the exact shape for many fibres at l0/R = 6, relative"
        f" least squares; at most {_CLOSE:g} % counted as an approximation",
        tolerance=_CLOSE,
    )


def _coefficients() -> Claim:
    law = fit_pleated(value("slenderness"), (value("valid_from") * PERCENT, largest()))
    return Claim(
        id="D-04",
        what="f0 to f4 of (2)",
        printed="not printed",
        recomputed=(law.f0, law.f1, law.f2, law.f3, law.f4),
        unit="1",
        verdict=Verdict.NOT_REPRODUCIBLE,
        reason="the paper fits them to its measurements and prints neither; these are fitted to the"
        " exact shape, the limit of many fibres, and are no substitute for N = 25 or 40",
    )


def _muscle_like() -> Claim:
    slenderness = value("slenderness")
    ends = [
        pleated_shape_function(eps, slenderness)
        for eps in (value("valid_from") * PERCENT, largest())
    ]
    return Claim(
        id="D-05",
        what="very high forces at small contractions and very low ones at large: f_t0 at 5 %, 35 %",
        printed="very high, very low",
        recomputed=tuple(ends),
        unit="1",
        verdict=holds(ends[0] > 10.0 * ends[1] > 0.0, Verdict.INCONSISTENT),
        reason=f"exact shape, l0/R = 6; a factor of {ends[0] / ends[1]:.0f}, above 10 counted as"
        " very",
    )


def _below_five_percent() -> Claim:
    slenderness, eps = value("slenderness"), 0.2 * value("valid_from") * PERCENT
    law = fit_pleated(slenderness, (value("valid_from") * PERCENT, largest()))
    told = pleated_function(eps, law.f0, law.f1, law.f2, law.f3, law.f4)
    found = (told / pleated_shape_function(eps, slenderness) - 1.0) / PERCENT
    return Claim(
        id="D-06",
        what="the model is only valid above 5 %: (2) at 1 % against the shape it approximates",
        printed="only valid for contractions above 5 %",
        recomputed=found,
        unit="%",
        verdict=holds(found > _CLOSE, Verdict.INCONSISTENT),
        reason="the paper's reason is the elasticity of the fibres, of which it prints nothing;"
        " this is another one: f0/eps diverges faster than the exact shape, pi R/(l0 sqrt(6 eps))",
        tolerance=_CLOSE,
    )


def _imposed_force() -> Claim:
    amplitude, offset = value("force_amplitude"), value("force_offset")
    lowest = offset - amplitude
    return Claim(
        id="D-07",
        what="F(t) = A sin(wt) + B with A = 1400 N, B = 750 N: smallest and largest force",
        printed="a force function imposed on a muscle",
        recomputed=(lowest, offset + amplitude),
        unit="N",
        verdict=holds(lowest >= 0.0, Verdict.INCONSISTENT),
        reason="a muscle cannot push with 650 N. With 1400 N as the whole swing, A = 700 N, the"
        f" force would stay between {offset - amplitude / 2.0:g} and {offset + amplitude / 2.0:g} N"
        " and reach the contractions of D-08",
        tolerance=0.0,
    )


def _contraction_at(scaled: float) -> float:
    slenderness = value("slenderness")
    return root(lambda eps: pleated_shape_function(eps, slenderness) - scaled, 1e-5, 0.45, 1e-12)


def _contractions_reached() -> Claim:
    lowest = value("force_offset") - value("force_amplitude") / 2.0
    found = [_contraction_at(lowest / (p * length() ** 2)) / PERCENT for p in pressures()]
    printed = value("max_contraction")
    exchanged = value("force_amplitude") - value("force_offset")
    at_most = _contraction_at(exchanged / (max(pressures()) * length() ** 2)) / PERCENT
    return Claim(
        id="D-08",
        what="the major loop goes to eps_max = 35 %: contraction at the least force, 1, 1.5, 2.5"
        " bar",
        printed=printed,
        recomputed=tuple(found),
        unit="%",
        verdict=holds(min(found) <= printed <= max(found), Verdict.NOT_REPRODUCIBLE),
        reason=f"exact shape, many fibres, at {lowest:g} N, that is with 1400 N read as the whole"
        " swing; as printed the muscle would have to push, and with A and B exchanged it"
        f" would reach {at_most:.0f} % at most",
    )


def _fibres() -> Claim:
    return Claim(
        id="D-09",
        what="f_t0 of 25 fibres below that of 40 is consistent with the theoretical model",
        printed="consistent",
        recomputed=None,
        unit="",
        verdict=Verdict.NOT_REPRODUCIBLE,
        reason="the equations for a finite number of fibres are cited, not printed, and no point of"
        " the measured curves is; the limit of many fibres does not know N. Pressures"
        f" {', '.join(f'{p:g}' for p in printed_values('D', 'pressures'))} bar",
    )
