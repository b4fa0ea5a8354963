"""Sarosi, what (1) to (4) say of themselves, without any measurement."""

from __future__ import annotations

import math

import numpy as np

from pamsim.core.units import DEG_PER_RAD, PA_PER_BAR
from pamsim.muscles.braid import max_contraction
from pamsim.muscles.corrected_mckibben import corrected_mckibben_force
from pamsim.muscles.exponential import isobar, six_parameter_force
from pamsim.muscles.mckibben import ideal_force
from pamsim.muscles.published import PUBLISHED
from pamsim.muscles.single_pressure_exponential import single_pressure_force
from pamsim.papers.claim import Claim, Verdict, compare
from pamsim.papers.printed_number import printed_number, printed_values
from pamsim.papers.root import root

_PERCENT = 1e-2
_ANGLES = tuple(np.radians([15.0, 20.0, 25.0, 28.6, 32.0, 40.0]).tolist())
_BARS = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
_SERIES_ANGLE = printed_number("C", "fibre_angle").value
"""Fibre angle of the series as Nguyen 2024 prints it [deg]; Sarosi prints none."""
_TYPE = "DMSP-20-200"
"""The muscle of Sarosi."""


def claims() -> list[Claim]:
    """Claims E-01 to E-06."""
    return [
        _virtual_work(),
        _same_largest(),
        _angle(),
        _limits(),
        _pressure_unit(),
        _isobar(),
    ]


def _virtual_work() -> Claim:
    length, radius, pressure, worst = 0.2, 0.01, 3.0 * PA_PER_BAR, 0.0
    for angle in _ANGLES:
        a, b = 3.0 / math.tan(angle) ** 2, 1.0 / math.sin(angle) ** 2
        scale = pressure * math.pi * radius**2 * (a - b)
        for kappa in np.linspace(-0.05, 0.3, 36).tolist():
            told = pressure * math.pi * radius**2 * (a * (1.0 - kappa) ** 2 - b)
            law = ideal_force(pressure, (1.0 - kappa) * length, length, 2.0 * radius, angle)
            worst = max(worst, abs(told - law) / scale)
    return compare(
        "E-01",
        "(1) with a = 3/tan^2(alpha0), b = 1/sin^2(alpha0) is virtual work, -p dV/dl; deviation"
        " over the force at nominal length",
        0.0,
        worst,
        1e-12,
        unit="1",
        reason="against the slope of the braid's volume at six fibre angles, -5 to 30 %",
        otherwise=Verdict.INCONSISTENT,
    )


def _same_largest() -> Claim:
    angle = math.radians(_SERIES_ANGLE)

    def zero(pressure: float) -> float:
        return root(lambda k: ideal_force(pressure, 1.0 - k, 1.0, 0.02, angle), 0.0, 0.9, 1e-14)

    found = [zero(bar * PA_PER_BAR) for bar in _BARS]
    spread = max(found) - min(found)
    return compare(
        "E-02",
        "(1) predicts the same largest contraction for various pressures: spread, 1 to 6 bar",
        0.0,
        spread,
        1e-9,
        unit="1",
        reason=f"where (1) is zero, {found[0] / _PERCENT:.2f} % at every pressure for 28.6 deg"
        " (Nguyen 2024's muscle; Sarosi prints no angle)",
        otherwise=Verdict.INCONSISTENT,
    )


def _angle() -> Claim:
    low, high = printed_values("E", "max_contraction")
    angles = [
        math.acos(1.0 / (math.sqrt(3.0) * (1.0 - kappa * _PERCENT))) * DEG_PER_RAD
        for kappa in (low, high)
    ]
    back = [max_contraction(angle / DEG_PER_RAD) / _PERCENT for angle in angles]
    return Claim(
        id="E-03",
        what="maximum contraction of 25-27 % in (1): the fibre angle alpha0 it takes",
        printed="alpha0 not printed",
        recomputed=tuple(angles),
        unit="deg",
        verdict=Verdict.NOT_REPRODUCIBLE,
        reason=f"(1) is zero there at {back[0]:.0f} and {back[1]:.0f} %; Nguyen 2024 prints 28.6"
        " deg for the same series, which gives 34 %. The maker's limit is one of rubber and ends,"
        " so it does not determine alpha0",
    )


def _limits() -> Claim:
    angle, kappa, pressure = math.radians(_SERIES_ANGLE), 0.1, 20.0 * PA_PER_BAR
    decay = printed_number("E", "decay").value
    neutral = corrected_mckibben_force(pressure, kappa, 0.0, -1.0, 0.0, -1.0, decay, 0.02, angle)
    ideal = ideal_force(pressure, 1.0 - kappa, 1.0, 0.02, angle)
    high = corrected_mckibben_force(pressure, kappa, 5.0, -1.0, 0.0, -1.0, decay, 0.02, angle)
    return compare(
        "E-04",
        "(2) contains (1) and tends to it at high pressure: forces over that of (1)",
        (1.0, 1.0),
        (neutral / ideal, high / ideal),
        1e-6,
        unit="1",
        reason="a_eps = a_kappa = 0, b_eps = b_kappa = -1, then a_eps = 5 at 20 bar; so with the"
        " printed minus signs both b are negative, which the paper does not say",
        otherwise=Verdict.INCONSISTENT,
    )


def _pressure_unit() -> Claim:
    threshold, top = printed_number("E", "good_from").value, _BARS[-1]
    units = {"Pa": PA_PER_BAR, "kPa": 100.0, "bar": 1.0, "MPa": 0.1}
    share = {
        # What of the correction between 0 and 6 bar is gone at the threshold.
        unit: (1.0 - math.exp(-threshold * per_bar)) / (1.0 - math.exp(-top * per_bar))
        for unit, per_bar in units.items()
    }
    return Claim(
        id="E-05",
        what="unit of p in exp(-p) of (2): share of its change up to 6 bar that is over at 2 bar,"
        " for Pa, kPa, bar, MPa",
        printed="not printed",
        recomputed=tuple(share.values()),
        unit="1",
        verdict=Verdict.NOT_REPRODUCIBLE,
        reason="in Pa and kPa the correction vanishes at any pressure, in MPa it is spread over the"
        " whole range; only bar makes 2 bar a threshold, as the text has it. a_eps and b_eps mean"
        " nothing without the unit",
    )


def _isobar() -> Claim:
    law, worst = PUBLISHED[_TYPE], 0.0
    for bar in _BARS:
        single = isobar(law, bar * PA_PER_BAR)
        for kappa in np.linspace(0.0, 0.25, 26).tolist():
            told = single_pressure_force(0.0, kappa, single.a, single.b, single.d, single.e)
            both = six_parameter_force(
                bar * PA_PER_BAR, kappa, law.a, law.b, law.c, law.d, law.e, law.f
            )
            worst = max(worst, abs(told - both))
    return compare(
        "E-06",
        "(4) is (3) with first-order polynomials of pressure: (3) at one pressure less (4)",
        0.0,
        worst,
        1e-9,
        unit="N",
        reason=f"constants of the {_TYPE} from later work of the group, 1 to 6 bar, up to 25 %",
        otherwise=Verdict.INCONSISTENT,
    )
