"""Sarosi, its comparisons with measurements: on published force maps, since it prints no point."""

from __future__ import annotations

import numpy as np

from pamsim.core.units import PA_PER_BAR
from pamsim.muscles.force_law import coefficients_of
from pamsim.muscles.published import PUBLISHED
from pamsim.papers.claim import Claim, Verdict, holds
from pamsim.papers.printed_number import printed_number
from pamsim.papers.sarosi.maps import fitted_residual, measured, predicted, rms

_MAP = (
    "published force map of a DMSP-20-300N, 60 points where it pulls; Sarosi measured another"
    " length of the series and prints no point"
)


def claims() -> list[Claim]:
    """Claims E-12 to E-21."""
    return [
        _no_constants("E-12", "a_eps, b_eps, a_kappa, b_kappa of (2)"),
        _no_constants("E-13", "a to h of (4)"),
        _overestimates(),
        _good_above(),
        _helps_below(),
        _better(),
        _published("E-18", "DMSP-20-200", "DMSP-20"),
        _published("E-19", "DMSP-20-400", "DMSP-20"),
        _published("E-20", "DMSP-10", "DMSP-10"),
        _agreement(),
    ]


def _no_constants(id: str, names: str) -> Claim:
    return Claim(
        id=id,
        what=f"{names}, estimated by least squares",
        printed="not printed",
        recomputed=None,
        unit="",
        verdict=Verdict.NOT_REPRODUCIBLE,
        reason="neither the constants nor the measured forces are printed",
    )


def _overestimates() -> Claim:
    residual = fitted_residual("ideal")
    return Claim(
        id="E-14",
        what="(1) is only an initial approximation and needs correction: RMS and mean error",
        printed="significant differences",
        recomputed=(rms(residual), float(np.mean(residual))),
        unit="N",
        verdict=holds(
            rms(residual) > 3.0 * rms(fitted_residual("corrected")), Verdict.NOT_REPRODUCIBLE
        ),
        reason=f"{_MAP}. Geometry of Nguyen 2024, nothing fitted; three times the RMS of (2)"
        " counted as significant",
    )


def _above_and_below(law: str) -> tuple[float, float]:
    high = measured("DMSP-20").pressure >= printed_number("E", "good_from").value * PA_PER_BAR
    residual = fitted_residual(law)
    return rms(residual[high]), rms(residual[~high])


def _good_above() -> Claim:
    high = measured("DMSP-20").pressure >= printed_number("E", "good_from").value * PA_PER_BAR
    share = _above_and_below("strain")[0] / rms(measured("DMSP-20").force[high])
    return Claim(
        id="E-15",
        what="with eps alone (1) is very good from 2 bar on: RMS error over RMS force",
        printed="very good",
        recomputed=share,
        unit="1",
        verdict=holds(share <= 0.05, Verdict.NOT_REPRODUCIBLE),
        reason=f"{_MAP}. a_eps, b_eps and a constant factor fitted to all pressures; RMS"
        f" {_above_and_below('strain')[0]:.1f} N, at most 5 % counted as very good",
        tolerance=0.05,
    )


def _helps_below() -> Claim:
    without, with_mu = _above_and_below("strain"), _above_and_below("corrected")
    gains = [1.0 - b / a for a, b in zip(without, with_mu, strict=True)]
    return Claim(
        id="E-16",
        what="the factor mu is needed for smaller pressures: what it takes off the RMS error below"
        " 2 bar, and from 2 bar on",
        printed="to achieve similar approximation for smaller pressure",
        recomputed=(gains[1], gains[0]),
        unit="1",
        verdict=holds(gains[1] > gains[0], Verdict.NOT_REPRODUCIBLE),
        reason=f"{_MAP}. mu depends on contraction alone, so it changes the force by the same"
        " factor at every pressure: it mends small contractions, not small pressures",
    )


def _better() -> Claim:
    old, new = rms(fitted_residual("corrected")), rms(fitted_residual("exponential"))
    return Claim(
        id="E-17",
        what="(4) is a better approximation than (2): RMS errors of (2) and of (4)",
        printed="a better approximation",
        recomputed=(old, new),
        unit="N",
        verdict=holds(new < old, Verdict.NOT_REPRODUCIBLE),
        reason=f"{_MAP}. (2) has 4 constants, (4) 7 that count; both by least squares",
    )


def _published(id: str, kind: str, diameter: str) -> Claim:
    points = measured(diameter)
    force = predicted("six_parameter", coefficients_of(PUBLISHED[kind]), points)
    scale = float(force @ points.force / (force @ force))
    return Claim(
        id=id,
        what=f"the model agrees with experiment, with the group's later constants of the {kind}:"
        " RMS error, and RMS with one common factor",
        printed="the agreement confirms the viability",
        recomputed=(rms(force - points.force), rms(scale * force - points.force)),
        unit="N",
        verdict=Verdict.NOT_REPRODUCIBLE,
        reason=f"on the published map of a {diameter} of another length, highest force"
        f" {points.force.max():.0f} N; correlation"
        f" {float(np.corrcoef(force, points.force)[0, 1]):.4f}, best factor {scale:.2f}. Shapes"
        " agree, heights do not; Sarosi's own constants and points are not printed",
    )


def _agreement() -> Claim:
    points = measured("DMSP-20")
    residual = fitted_residual("exponential")
    explained = 1.0 - float(np.sum(residual**2) / np.sum((points.force - points.force.mean()) ** 2))
    return Claim(
        id="E-21",
        what="an accurate and simple model: share of the variance (4) explains once fitted",
        printed="accurate",
        recomputed=explained,
        unit="1",
        verdict=holds(explained >= 0.99, Verdict.NOT_REPRODUCIBLE),
        reason=f"{_MAP}, in sample; no correlation, R2 or RMS is printed to compare with, 0.99"
        " counted as accurate",
        tolerance=0.01,
    )
