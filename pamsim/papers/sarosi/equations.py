"""Sarosi, equations (1) to (5), their constants, and measurements beside them.

The paper prints no point: its comparisons are made on published force maps.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from pamsim.core.units import DEG_PER_RAD, PA_PER_BAR, FloatArray
from pamsim.papers.claim import Order, Recomputed, recomputes
from pamsim.papers.nguyen2024.geometry import PERCENT, force_map, muscle
from pamsim.papers.numerics import PrintedNumbers, jacobian, least_squares, rms, root
from pamsim.physics.braid import max_contraction
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.exponential import six_parameter_force
from pamsim.physics.force_laws.force_law import coefficients_of
from pamsim.physics.force_laws.published import PUBLISHED

Form = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]

TYPE = "DMSP-20-200"
"""The muscle of Sarosi."""
BARS = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
_PRINTED = PrintedNumbers("sarosi")
_ONE_PRESSURE = (280.0, -30.0, 0.5, -900.0, -20.0)
_ALL_PRESSURES = (-4.0, 280.0, -30.0, 0.5, -900.0, 50.0, 290.0, -270.0)
"""Where the derivatives are taken: of the size of the published constants, p in bar."""

MAPS = {"DMSP-20": "dmsp20_300_force_map.csv", "DMSP-10": "dmsp10_250_force_map.csv"}
"""Diameter -> published force map (Martens and Boblan, Actuators 2017, 6, 33)."""
_DECAY, _BAR = _PRINTED.value("decay"), PA_PER_BAR
_FITS = {
    "exponential": (
        "invertible_exponential",
        lambda a, b, c, e, f, g, h: (1.0, a / _BAR, b, c, e / _BAR, f, g / _BAR, h),
        [0.0, 300.0, -30.0, -900.0, 0.0, 300.0, -300.0],
    ),
    "strain": (
        "corrected_mckibben",
        lambda a, b, factor: (1.0, a, b, 0.0, factor, _DECAY),
        [1.0, -1.0, -1.0],
    ),
    "corrected": ("corrected_mckibben", lambda *v: (1.0, *v, _DECAY), [1.0, -1.0, 0.1, -1.0]),
}
"""Name of a fit -> law of the catalog, its coefficients from what is fitted, start."""


@recomputes("sarosi-03")
def _angle() -> Recomputed:
    angles = [
        math.acos(1.0 / (math.sqrt(3.0) * (1.0 - kappa * PERCENT))) * DEG_PER_RAD
        for kappa in _PRINTED.values("max_contraction")
    ]
    back = [max_contraction(angle / DEG_PER_RAD) / PERCENT for angle in angles]
    return Recomputed(tuple(angles), least=back[0], most=back[1])


@recomputes("sarosi-05")
def _pressure_unit() -> list[float]:
    """What of the correction between 0 and 6 bar is gone at the threshold, by units of pressure."""
    threshold, top = _PRINTED.value("good_from"), BARS[-1]
    per_bar = (PA_PER_BAR, 100.0, 1.0, 0.1)  # Pa, kPa, bar, MPa
    return [(1.0 - math.exp(-threshold * one)) / (1.0 - math.exp(-top * one)) for one in per_bar]


def force(pressure: float, kappa: float) -> float:
    """Force [N] of (4) at a gauge pressure [Pa] and a contraction [-], published constants."""
    return six_parameter_force(pressure, kappa, *coefficients_of(PUBLISHED[TYPE])[1:])


def pressure_for(force: float, kappa: float) -> float:
    """Gauge pressure [Pa] that gives a force [N] at a contraction [-]: (5), the inverse of (4).

    The d and f of Sarosi (4) are 0; its e, g, h are d, e, f of the law.
    """
    law = PUBLISHED[TYPE]
    rise = math.exp(law.c * kappa)
    return (force - law.b * rise - law.f) / (law.a * rise + law.d * kappa + law.e)


def _single(v: FloatArray, p: FloatArray, kappa: FloatArray) -> FloatArray:
    a, b, c, d, e = v
    return a * np.exp(b * kappa + c) + d * kappa + e


def _both(v: FloatArray, p: FloatArray, kappa: FloatArray) -> FloatArray:
    a, b, c, d, e, f, g, h = v
    return (a * p + b) * np.exp(c * kappa + d) + (e * p + f) * kappa + g * p + h


@recomputes("sarosi-07", each=((_single, _ONE_PRESSURE), (_both, _ALL_PRESSURES)))
def _rank(law: Form, place: tuple[float, ...]) -> float:
    p, kappa = (axis.ravel() for axis in np.meshgrid(BARS, np.linspace(0.0, 0.25, 11)))
    columns = jacobian(lambda v: law(v, p, kappa), place)
    columns /= np.linalg.norm(columns, axis=0)
    return float(np.linalg.matrix_rank(columns, tol=1e-6))


@recomputes("sarosi-11")
def _published_largest() -> Recomputed:
    low, high = _PRINTED.all_digits("max_contraction")
    result = root(lambda k: force(BARS[-1] * PA_PER_BAR, k), 0.1, 0.4, 1e-12)
    return Recomputed(result / PERCENT, low=low, high=high)


class MeasuredForces(NamedTuple):
    """Points of a map where the muscle pulled: gauge pressure [Pa], contraction [-], force [N]."""

    pressure: FloatArray
    contraction: FloatArray
    force: FloatArray


@functools.cache
def measured(kind: str) -> MeasuredForces:
    """A map without its zeros, which mean slack or not measured."""
    table = force_map(MAPS[kind])
    return MeasuredForces(*table[:, table[2] != 0.0])


def predicted(law: str, coefficients: tuple[float, ...], points: MeasuredForces) -> FloatArray:
    """Forces of a law of the catalog at the points of a map [N].

    The geometry is that of the mapped DMSP-20-300N as Nguyen 2024 prints it; Sarosi prints none.
    """
    entry, braid = FORCE_LAWS[law], muscle()
    pairs = zip(points.pressure.tolist(), points.contraction.tolist(), strict=True)
    return np.array([entry.force(p, kappa, coefficients, braid) for p, kappa in pairs])


def fitted(law: str, points: MeasuredForces) -> tuple[tuple[float, ...], FloatArray]:
    """Least squares of a law on the points of a map.

    Laws are ``ideal`` (nothing to fit), ``strain`` ((2) with mu constant), ``corrected`` ((2)) and
    ``exponential`` ((4)). What comes back are its coefficients in the catalog, and predicted less
    measured force (n,) [N].
    """
    if law == "ideal":
        return (1.0,), predicted("ideal_mckibben", (1.0,), points) - points.force
    name, coefficients, start = _FITS[law]

    def force(*values: float) -> FloatArray:
        return predicted(name, coefficients(*values), points)

    found, _ = least_squares(force, points.force, start, x_scale="jac", max_nfev=2000)
    return coefficients(*found.tolist()), force(*found) - points.force


@functools.cache
def fitted_residual(law: str) -> FloatArray:
    """Residual of `fitted` on the map of a DMSP-20 (n,) [N]."""
    return fitted(law, measured("DMSP-20"))[1]


@recomputes("sarosi-14")
def _overestimates() -> Recomputed:
    residual = fitted_residual("ideal")
    scatter = rms(fitted_residual("exponential"))
    return Recomputed(rms(residual), low=scatter, points_n=scatter, mean=float(np.mean(residual)))


def _above_and_below(values: FloatArray) -> tuple[float, float]:
    """RMS over the points of the map from the printed pressure on, and over the others."""
    limit = _PRINTED.value("good_from") * PA_PER_BAR
    high = measured("DMSP-20").pressure >= limit
    return rms(values[high]), rms(values[~high])


@recomputes("sarosi-15")
def _good_above() -> Recomputed:
    errors = _above_and_below(fitted_residual("strain"))
    sizes = _above_and_below(measured("DMSP-20").force)
    shares = [error / size for error, size in zip(errors, sizes, strict=True)]
    return Recomputed(shares, order=Order.RISING, rms=errors[0])


@recomputes("sarosi-16")
def _helps_below() -> Recomputed:
    without, with_mu = (_above_and_below(fitted_residual(law)) for law in ("strain", "corrected"))
    gains = [1.0 - b / a for a, b in zip(without, with_mu, strict=True)]
    return Recomputed((gains[1], gains[0]), order=Order.FALLING)


@recomputes("sarosi-17")
def _better() -> Recomputed:
    old, new = rms(fitted_residual("corrected")), rms(fitted_residual("exponential"))
    return Recomputed((old, new), order=Order.FALLING)


@recomputes(
    "sarosi-18",
    each=(("DMSP-20-200", "DMSP-20"), ("DMSP-20-400", "DMSP-20"), ("DMSP-10", "DMSP-10")),
)
def _published(kind: str, diameter: str) -> Recomputed:
    points = measured(diameter)
    force = predicted("six_parameter", coefficients_of(PUBLISHED[kind]), points)
    scale = float(force @ points.force / (force @ force))
    return Recomputed(
        (rms(force - points.force), rms(scale * force - points.force)),
        diameter=diameter,
        highest=points.force.max(),
        correlation=float(np.corrcoef(force, points.force)[0, 1]),
        scale=scale,
    )


@recomputes("sarosi-21")
def _agreement() -> float:
    force, residual = measured("DMSP-20").force, fitted_residual("exponential")
    total = float(np.sum((force - force.mean()) ** 2))
    return 1.0 - float(np.sum(residual**2)) / total
