"""Sarosi, its comparisons with measurements: on published force maps, since it prints no point."""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np

from pamsim.core.units import PA_PER_BAR, FloatArray
from pamsim.papers.claim import Order, Recomputed, printed_number, recomputes
from pamsim.papers.nguyen2024.geometry import muscle
from pamsim.papers.numerics import least_squares, rms
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.force_law import coefficients_of
from pamsim.physics.force_laws.published import PUBLISHED
from pamsim.recordings.printed import printed_table

MAPS = {"DMSP-20": "dmsp20_300_force_map.csv", "DMSP-10": "dmsp10_250_force_map.csv"}
"""Diameter -> published force map (Martens and Boblan, Actuators 2017, 6, 33)."""

_DECAY, _BAR = printed_number("sarosi", "decay").value, PA_PER_BAR
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


class MeasuredForces(NamedTuple):
    """Points of a map where the muscle pulled: gauge pressure [Pa], contraction [-], force [N]."""

    pressure: FloatArray
    contraction: FloatArray
    force: FloatArray


@functools.cache
def measured(kind: str) -> MeasuredForces:
    """A map without its zeros, which mean slack or not measured."""
    names = ("p_gauge_Pa", "contraction_ratio", "force_N")
    table = np.array([[float(row[name]) for name in names] for row in printed_table(MAPS[kind])])
    return MeasuredForces(*table[table[:, 2] != 0.0].T)


def predicted(law: str, coefficients: tuple[float, ...], points: MeasuredForces) -> FloatArray:
    """Forces of a law of the catalog at the points of a map [N].

    The geometry is that of the mapped DMSP-20-300N as Nguyen 2024 prints it; Sarosi prints none.
    """
    entry, braid = FORCE_LAWS[law], muscle()
    pairs = zip(points.pressure.tolist(), points.contraction.tolist(), strict=True)
    return np.array([entry.force(p, kappa, coefficients, braid) for p, kappa in pairs])


@functools.cache
def fitted_residual(law: str) -> FloatArray:
    """Predicted less measured force on the DMSP-20 map after a least-squares fit [N].

    Args:
        law: ``ideal`` (nothing to fit), ``strain`` ((2) with mu constant), ``corrected`` ((2)) or
            ``exponential`` ((4)).
    """
    points = measured("DMSP-20")
    if law == "ideal":
        return predicted("ideal_mckibben", (1.0,), points) - points.force
    name, coefficients, start = _FITS[law]

    def force(*values: float) -> FloatArray:
        return predicted(name, coefficients(*values), points)

    fitted, _ = least_squares(force, points.force, start, x_scale="jac", max_nfev=2000)
    return force(*fitted) - points.force


@recomputes("sarosi-14")
def _overestimates() -> Recomputed:
    residual = fitted_residual("ideal")
    scatter = rms(fitted_residual("exponential"))
    return Recomputed(rms(residual), low=scatter, points_n=scatter, mean=float(np.mean(residual)))


def _above_and_below(values: FloatArray) -> tuple[float, float]:
    """RMS over the points of the map from the printed pressure on, and over the others."""
    limit = printed_number("sarosi", "good_from").value * PA_PER_BAR
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


@recomputes("sarosi-18", "DMSP-20-200", "DMSP-20")
@recomputes("sarosi-19", "DMSP-20-400", "DMSP-20")
@recomputes("sarosi-20", "DMSP-10", "DMSP-10")
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
def _agreement() -> Recomputed:
    force, residual = measured("DMSP-20").force, fitted_residual("exponential")
    total = float(np.sum((force - force.mean()) ** 2))
    return Recomputed(1.0 - float(np.sum(residual**2)) / total)
