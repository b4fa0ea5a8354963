"""The static law (17), (23) against Tables 1 and 2, and the sentences on its course."""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from pamsim.core.units import DEG_PER_RAD, PA_PER_BAR, PA_PER_KPA
from pamsim.papers.claim import Claim, Verdict, compare, half_unit, holds
from pamsim.papers.paper_models import static_characteristic
from pamsim.signals.static_law import exponential_slope, odd_exponential_basis
from pamsim.store.printed import distinct_steps, mas20_models

FloatArray = NDArray[np.float64]

_DIGITS = (3, 4, 3)  # decimals of a0, a1, a2 in (23)
_ANGLE_LIMIT = 0.144
"""RMS misfit up to which a curve passes through the tables [deg]: one encoder increment."""


def claims() -> list[Claim]:
    """Claims A-09 to A-16."""
    return [
        _fitted_in_bar(),
        _fitted_with_scale(),
        _printed_in_bar(),
        _printed_with_scale(),
        _origin(),
        _end_value(),
        _decreasing(),
        _proportional(),
    ]


def _data() -> tuple[FloatArray, FloatArray]:
    """Pressure difference [Pa] and angle [deg] of the distinct rows."""
    steps = distinct_steps()
    difference = np.array([step.pressure[0] - step.pressure[1] for step in steps])
    return difference, np.array([step.angle for step in steps]) * DEG_PER_RAD


def _fit(scale: float) -> tuple[tuple[float, ...], float]:
    """Least squares of (17), continued as an odd function: coefficients and RMS [deg]."""
    difference, angle = _data()
    basis = odd_exponential_basis(difference / scale)
    found = np.linalg.lstsq(basis, angle, rcond=None)[0]
    return tuple(float(a) for a in found), float(np.sqrt(np.mean((basis @ found - angle) ** 2)))


def _printed() -> tuple[float, float, float]:
    law = mas20_models()["static"]
    return float(law["a0_deg"]), float(law["a1_deg"]), float(law["a2_deg"])


def _fitted_in_bar() -> Claim:
    found, rms = _fit(PA_PER_BAR)
    return compare(
        "A-09",
        "coefficients a0, a1, a2 of (23), fitted to the tables with p_svd in bar",
        _printed(),
        found,
        [half_unit(digits) for digits in _DIGITS],
        unit="deg",
        reason=f"linear least squares of (17) on the 21 distinct rows, {rms:.2f} deg RMS; the"
        " paper fitted data of its Figure 6, which it does not print",
    )


def _fitted_with_scale() -> Claim:
    best = minimize_scalar(
        lambda scale: _fit(float(scale))[1], bounds=(0.3e5, 6e5), method="bounded"
    )
    found, rms = _fit(float(best.x))
    return compare(
        "A-10",
        "coefficients a0, a1, a2 of (23), fitted to the tables with the unit of pressure free",
        _printed(),
        found,
        [half_unit(digits) for digits in _DIGITS],
        unit="deg",
        reason=f"least squares of (17) with the scale as a fourth unknown: p_svd in units of"
        f" {best.x / PA_PER_KPA:.0f} kPa, {rms:.2f} deg RMS. There a2 vanishes: x exp(-x) is what a"
        " change of scale adds to exp(-x), so a2 is spare. No unit of pressure gives (23)",
    )


def _printed_in_bar() -> Claim:
    rms = float(static_characteristic()["rms_bar_deg"])
    return compare(
        "A-11",
        "(23) describes the actuator's end positions, p_svd in bar; RMS misfit to the tables",
        0.0,
        rms,
        _ANGLE_LIMIT,
        unit="deg",
        reason="printed coefficients, odd in p_svd, on the 21 distinct rows; tolerance: one"
        " encoder increment. The unit of p_svd in (23) is not printed",
        otherwise=Verdict.INCONSISTENT,
    )


def _printed_with_scale() -> Claim:
    found = static_characteristic()
    return compare(
        "A-12",
        "(23) describes the actuator's end positions, any unit of pressure; RMS misfit",
        0.0,
        float(found["rms_scaled_deg"]),
        _ANGLE_LIMIT,
        unit="deg",
        reason=f"printed coefficients with the pressure that counts as 1 chosen for the least"
        f" misfit, {found['scale_kpa']:.0f} kPa, which is no unit; tolerance: one encoder"
        " increment",
        otherwise=Verdict.INCONSISTENT,
    )


def _origin() -> Claim:
    a0, a1, _ = _printed()
    return compare(
        "A-13",
        "equal pressures hold the arm at the reference point: beta(0) of (23)",
        0.0,
        a0 + a1,
        half_unit(_DIGITS[0]) + half_unit(_DIGITS[1]),
        unit="deg",
        reason=f"a0 + a1; continued as the four-quadrant, symmetric law the paper claims, (23)"
        f" jumps by {2.0 * (a0 + a1):.2f} deg at p_svd = 0",
        otherwise=Verdict.INCONSISTENT,
    )


def _end_value() -> Claim:
    a0, a1, a2 = _printed()
    top = 1.0 - a1 / a2  # where (a2 - a1 - a2 x) exp(-x) = 0
    highest = a0 + (a1 + a2 * top) * math.exp(-top)
    largest = float(np.max(np.abs(_data()[1])))
    return compare(
        "A-14",
        "largest angle: Table 1, row 3, against what (23) can reach at all",
        largest,
        highest,
        _ANGLE_LIMIT,
        unit="deg",
        reason=f"(23) has its maximum at x = {top:.2f} in any unit of pressure; tolerance: one"
        " encoder increment",
        otherwise=Verdict.INCONSISTENT,
    )


def _decreasing() -> Claim:
    _, a1, a2 = _printed()
    x = np.linspace(0.0, 5.0, 501)  # 0 to 500 kPa, read in bar
    slope = exponential_slope(x, a1, a2)
    falls = bool(np.all(np.diff(slope) < 0.0))
    difference, angle = _data()
    unloaded = np.array([step.load == 0.0 for step in distinct_steps()])
    order = np.argsort(np.abs(difference[unloaded]))
    size, turn = np.abs(difference[unloaded])[order], np.abs(angle[unloaded])[order]
    # Three groups of steps, each averaged: single neighbours lie within the scatter.
    means = [
        (size[group].mean(), turn[group].mean())
        for group in np.array_split(np.arange(len(size)), 3)
    ]
    points = [(0.0, 0.0), *means]
    secants = [(b[1] - a[1]) / (b[0] - a[0]) * PA_PER_KPA for a, b in itertools.pairwise(points)]
    return Claim(
        id="A-15",
        what="beta grows along a curve of decreasing inclination",
        printed="decreasing inclination",
        recomputed=tuple(float(s) for s in secants),
        unit="deg/kPa",
        verdict=holds(falls and secants[0] > secants[1] > secants[2], Verdict.INCONSISTENT),
        reason=f"slope of (23) falls from {slope[0]:.1f} to {slope[-1]:.2f} deg per unit of"
        " pressure; recomputed are the secants between the means of the unloaded rows in"
        " thirds, from small to large steps",
    )


def _proportional() -> Claim:
    difference, angle = _data()
    gains = angle / difference * PA_PER_KPA
    slope = float(difference @ angle / (difference @ difference))
    rms = float(np.sqrt(np.mean((slope * difference - angle) ** 2)))
    return Claim(
        id="A-16",
        what="the arm's position is proportional to the difference of pressures (section 3.1)",
        printed="proportional",
        recomputed=(float(gains.min()), float(gains.max())),
        unit="deg/kPa",
        verdict=holds(rms <= _ANGLE_LIMIT, Verdict.INCONSISTENT),
        reason=f"smallest and largest beta / p_svd of the rows; one factor for all leaves"
        f" {rms:.1f} deg RMS. The paper itself calls the relation non-linear elsewhere",
    )
