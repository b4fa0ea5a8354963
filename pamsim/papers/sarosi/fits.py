"""Sarosi, its comparisons with measurements: on published force maps, since it prints no point."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pamsim.core.units import PA_PER_BAR
from pamsim.papers.claim import Order, Recomputed, printed_number, recomputes
from pamsim.papers.sarosi.maps import fitted_residual, measured, predicted, rms
from pamsim.physics.force_laws.force_law import coefficients_of
from pamsim.physics.force_laws.published import PUBLISHED


@recomputes("sarosi-14")
def _overestimates() -> Recomputed:
    residual = fitted_residual("ideal")
    scatter = rms(fitted_residual("exponential"))
    return Recomputed(rms(residual), low=scatter, points_n=scatter, mean=float(np.mean(residual)))


def _high() -> NDArray[np.bool_]:
    """Points of the map from the printed pressure on."""
    limit = printed_number("sarosi", "good_from").value * PA_PER_BAR
    return measured("DMSP-20").pressure >= limit


def _above_and_below(law: str) -> tuple[float, float]:
    high, residual = _high(), fitted_residual(law)
    return rms(residual[high]), rms(residual[~high])


@recomputes("sarosi-15")
def _good_above() -> Recomputed:
    force, errors = measured("DMSP-20").force, _above_and_below("strain")
    sizes = rms(force[_high()]), rms(force[~_high()])
    shares = [error / size for error, size in zip(errors, sizes, strict=True)]
    return Recomputed(shares, order=Order.RISING, rms=errors[0])


@recomputes("sarosi-16")
def _helps_below() -> Recomputed:
    without, with_mu = _above_and_below("strain"), _above_and_below("corrected")
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
    points = measured("DMSP-20")
    residual = fitted_residual("exponential")
    total = float(np.sum((points.force - points.force.mean()) ** 2))
    return Recomputed(1.0 - float(np.sum(residual**2)) / total)
