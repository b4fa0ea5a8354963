"""Sarosi, equations (1) to (5) and their constants, without any measurement."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from pamsim.core.units import DEG_PER_RAD, PA_PER_BAR, FloatArray
from pamsim.papers.claim import (
    AGREES,
    Recomputed,
    agreeing,
    printed_number,
    printed_numbers,
    printed_values,
    recomputes,
)
from pamsim.papers.numerics import jacobian, root
from pamsim.physics.braid import max_contraction
from pamsim.physics.force_laws.exponential import (
    SinglePressureExponential,
    SixParameter,
    single_pressure_force,
    six_parameter_force,
)
from pamsim.physics.force_laws.force_law import coefficients_of
from pamsim.physics.force_laws.mckibben import corrected_mckibben_force, ideal_force
from pamsim.physics.force_laws.published import PUBLISHED

Form = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]

TYPE = "DMSP-20-200"
"""The muscle of Sarosi."""
BARS = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
_PERCENT = 1e-2
_CONTRACTIONS = np.linspace(0.0, 0.25, 26).tolist()
_ANGLES = tuple(np.radians([15.0, 20.0, 25.0, 28.6, 32.0, 40.0]).tolist())
_SERIES_ANGLE = printed_number("nguyen2024", "fibre_angle").value
"""Fibre angle of the series as Nguyen 2024 prints it [deg]; Sarosi prints none."""
_ONE_PRESSURE = (280.0, -30.0, 0.5, -900.0, -20.0)
_ALL_PRESSURES = (-4.0, 280.0, -30.0, 0.5, -900.0, 50.0, 290.0, -270.0)
"""Where the derivatives are taken: of the size of the published constants, p in bar."""


@recomputes("sarosi-01")
def _virtual_work() -> Recomputed:
    length, radius, pressure, worst = 0.2, 0.01, 3.0 * PA_PER_BAR, 0.0
    for angle in _ANGLES:
        a, b = 3.0 / math.tan(angle) ** 2, 1.0 / math.sin(angle) ** 2
        scale = pressure * math.pi * radius**2 * (a - b)
        for kappa in np.linspace(-0.05, 0.3, 36).tolist():
            by_paper = pressure * math.pi * radius**2 * (a * (1.0 - kappa) ** 2 - b)
            law = ideal_force(pressure, (1.0 - kappa) * length, length, 2.0 * radius, angle)
            worst = max(worst, abs(by_paper - law) / scale)
    return Recomputed(worst, high=AGREES)


@recomputes("sarosi-02")
def _same_largest() -> Recomputed:
    angle = math.radians(_SERIES_ANGLE)

    def zero(pressure: float) -> float:
        return root(lambda k: ideal_force(pressure, 1.0 - k, 1.0, 0.02, angle), 0.0, 0.9, 1e-14)

    result = [zero(bar * PA_PER_BAR) for bar in BARS]
    return Recomputed(max(result) - min(result), high=AGREES, end=result[0] / _PERCENT)


@recomputes("sarosi-03")
def _angle() -> Recomputed:
    angles = [
        math.acos(1.0 / (math.sqrt(3.0) * (1.0 - kappa * _PERCENT))) * DEG_PER_RAD
        for kappa in printed_values("sarosi", "max_contraction")
    ]
    back = [max_contraction(angle / DEG_PER_RAD) / _PERCENT for angle in angles]
    return Recomputed(tuple(angles), least=back[0], most=back[1])


@recomputes("sarosi-04")
def _limits() -> Recomputed:
    angle, kappa, pressure = math.radians(_SERIES_ANGLE), 0.1, 20.0 * PA_PER_BAR
    decay = printed_number("sarosi", "decay").value
    ideal = ideal_force(pressure, 1.0 - kappa, 1.0, 0.02, angle)
    neutral, high = (
        corrected_mckibben_force(pressure, kappa, a, -1.0, 0.0, -1.0, decay, 0.02, angle) / ideal
        for a in (0.0, 5.0)
    )
    return Recomputed((neutral, high), **agreeing(1.0, 1.0))


@recomputes("sarosi-05")
def _pressure_unit() -> Recomputed:
    """What of the correction between 0 and 6 bar is gone at the threshold, by units of pressure."""
    threshold, top = printed_number("sarosi", "good_from").value, BARS[-1]
    per_bar = (PA_PER_BAR, 100.0, 1.0, 0.1)  # Pa, kPa, bar, MPa
    share = [(1.0 - math.exp(-threshold * one)) / (1.0 - math.exp(-top * one)) for one in per_bar]
    return Recomputed(tuple(share))


def isobar(law: SixParameter, pressure: float) -> SinglePressureExponential:
    """The law at one gauge pressure [Pa]: what (3) is to (4)."""
    return SinglePressureExponential(
        scale=law.scale,
        a=law.a * pressure + law.b,
        b=law.c,
        d=law.d * pressure,
        e=law.e * pressure + law.f,
    )


def force(law: SixParameter, pressure: float, kappa: float) -> float:
    """Force [N] of (4) at a gauge pressure [Pa] and a contraction [-]."""
    return six_parameter_force(pressure, kappa, *coefficients_of(law)[1:])


@recomputes("sarosi-06")
def _isobar() -> Recomputed:
    law, worst, size = PUBLISHED[TYPE], 0.0, 0.0
    for bar in BARS:
        single = isobar(law, bar * PA_PER_BAR)
        for kappa in _CONTRACTIONS:
            by_paper = single_pressure_force(0.0, kappa, single.a, single.b, single.d, single.e)
            both = force(law, bar * PA_PER_BAR, kappa)
            worst, size = max(worst, abs(by_paper - both)), max(size, abs(both))
    return Recomputed(worst, high=AGREES * size)


def _single(v: FloatArray, p: FloatArray, kappa: FloatArray) -> FloatArray:
    a, b, c, d, e = v
    return a * np.exp(b * kappa + c) + d * kappa + e


def _both(v: FloatArray, p: FloatArray, kappa: FloatArray) -> FloatArray:
    a, b, c, d, e, f, g, h = v
    return (a * p + b) * np.exp(c * kappa + d) + (e * p + f) * kappa + g * p + h


@recomputes("sarosi-07", _single, _ONE_PRESSURE)
@recomputes("sarosi-08", _both, _ALL_PRESSURES)
def _rank(law: Form, place: tuple[float, ...]) -> Recomputed:
    p, kappa = (axis.ravel() for axis in np.meshgrid(BARS, np.linspace(0.0, 0.25, 11)))
    columns = jacobian(lambda v: law(v, p, kappa), place)
    columns /= np.linalg.norm(columns, axis=0)
    return Recomputed(float(np.linalg.matrix_rank(columns, tol=1e-6)))


def pressure_for(law: SixParameter, force: float, kappa: float) -> float:
    """Gauge pressure [Pa] that gives a force [N] at a contraction [-]: Sarosi (5).

    The d and f of Sarosi (4) are 0; its e, g, h are d, e, f of the law.
    """
    rise = math.exp(law.c * kappa)
    return -(-force + law.b * rise + law.f) / _per_pressure(law, kappa)


def _per_pressure(law: SixParameter, kappa: float) -> float:
    """The denominator of (5), dF/dp [N/Pa]."""
    return law.a * math.exp(law.c * kappa) + law.d * kappa + law.e


@recomputes("sarosi-09")
def _inverse() -> Recomputed:
    law = PUBLISHED[TYPE]
    worst = max(
        abs(pressure_for(law, force(law, bar * PA_PER_BAR, k), k) - bar * PA_PER_BAR)
        for bar in BARS
        for k in _CONTRACTIONS
    )
    least = min(_per_pressure(law, k) * PA_PER_BAR for k in _CONTRACTIONS)
    return Recomputed(worst / PA_PER_BAR, high=AGREES * max(BARS), least=least)


@recomputes("sarosi-11")
def _published_largest() -> Recomputed:
    law, top = PUBLISHED[TYPE], BARS[-1] * PA_PER_BAR
    low, high = printed_numbers("sarosi", "max_contraction")
    result = root(lambda k: force(law, top, k), 0.1, 0.4, 1e-12)
    return Recomputed(result / _PERCENT, low=low, high=high)
