"""Equations (1) to (4) by themselves, without any measurement."""

from __future__ import annotations

import math

import numpy as np

from pamsim.core.units import DEG_PER_RAD, PA_PER_BAR
from pamsim.papers.claim import (
    AGREES,
    Recomputed,
    agreeing,
    printed_number,
    printed_values,
    recomputes,
)
from pamsim.papers.numerics import root
from pamsim.physics.braid import max_contraction
from pamsim.physics.force_laws.exponential import (
    SinglePressureExponential,
    SixParameter,
    single_pressure_force,
    six_parameter_force,
)
from pamsim.physics.force_laws.mckibben import corrected_mckibben_force, ideal_force
from pamsim.physics.force_laws.published import PUBLISHED

_PERCENT = 1e-2
_ANGLES = tuple(np.radians([15.0, 20.0, 25.0, 28.6, 32.0, 40.0]).tolist())
_BARS = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
_SERIES_ANGLE = printed_number("nguyen2024", "fibre_angle").value
"""Fibre angle of the series as Nguyen 2024 prints it [deg]; Sarosi prints none."""
_TYPE = "DMSP-20-200"
"""The muscle of Sarosi."""


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

    result = [zero(bar * PA_PER_BAR) for bar in _BARS]
    spread = max(result) - min(result)
    return Recomputed(spread, high=AGREES, end=result[0] / _PERCENT)


@recomputes("sarosi-03")
def _angle() -> Recomputed:
    low, high = printed_values("sarosi", "max_contraction")
    angles = [
        math.acos(1.0 / (math.sqrt(3.0) * (1.0 - kappa * _PERCENT))) * DEG_PER_RAD
        for kappa in (low, high)
    ]
    back = [max_contraction(angle / DEG_PER_RAD) / _PERCENT for angle in angles]
    return Recomputed(tuple(angles), least=back[0], most=back[1])


@recomputes("sarosi-04")
def _limits() -> Recomputed:
    angle, kappa, pressure = math.radians(_SERIES_ANGLE), 0.1, 20.0 * PA_PER_BAR
    decay = printed_number("sarosi", "decay").value
    neutral = corrected_mckibben_force(pressure, kappa, 0.0, -1.0, 0.0, -1.0, decay, 0.02, angle)
    ideal = ideal_force(pressure, 1.0 - kappa, 1.0, 0.02, angle)
    high = corrected_mckibben_force(pressure, kappa, 5.0, -1.0, 0.0, -1.0, decay, 0.02, angle)
    return Recomputed((neutral / ideal, high / ideal), **agreeing(1.0, 1.0))


@recomputes("sarosi-05")
def _pressure_unit() -> Recomputed:
    threshold, top = printed_number("sarosi", "good_from").value, _BARS[-1]
    units = {"Pa": PA_PER_BAR, "kPa": 100.0, "bar": 1.0, "MPa": 0.1}
    share = {
        # What of the correction between 0 and 6 bar is gone at the threshold.
        unit: (1.0 - math.exp(-threshold * per_bar)) / (1.0 - math.exp(-top * per_bar))
        for unit, per_bar in units.items()
    }
    return Recomputed(tuple(share.values()))


def isobar(law: SixParameter, pressure: float) -> SinglePressureExponential:
    """The law at one gauge pressure [Pa]: what (3) is to (4)."""
    return SinglePressureExponential(
        scale=law.scale,
        a=law.a * pressure + law.b,
        b=law.c,
        d=law.d * pressure,
        e=law.e * pressure + law.f,
    )


@recomputes("sarosi-06")
def _isobar() -> Recomputed:
    law, worst, size = PUBLISHED[_TYPE], 0.0, 0.0
    for bar in _BARS:
        single = isobar(law, bar * PA_PER_BAR)
        for kappa in np.linspace(0.0, 0.25, 26).tolist():
            by_paper = single_pressure_force(0.0, kappa, single.a, single.b, single.d, single.e)
            both = six_parameter_force(
                bar * PA_PER_BAR, kappa, law.a, law.b, law.c, law.d, law.e, law.f
            )
            worst, size = max(worst, abs(by_paper - both)), max(size, abs(both))
    return Recomputed(worst, high=AGREES * size)
