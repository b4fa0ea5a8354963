"""Sarosi, its comparisons with measurements: on published force maps, since it prints no point."""

from __future__ import annotations

import numpy as np

from pamsim.core.units import PA_PER_BAR
from pamsim.muscles.force_law import coefficients_of
from pamsim.muscles.published import PUBLISHED
from pamsim.papers.claim import Recomputed, printed_number, recomputes
from pamsim.papers.sarosi.maps import fitted_residual, measured, predicted, rms


@recomputes("sarosi-14")
def _overestimates() -> Recomputed:
    residual = fitted_residual("ideal")
    return Recomputed(
        (rms(residual), float(np.mean(residual))),
        holds=rms(residual) > 3.0 * rms(fitted_residual("corrected")),
    )


def _above_and_below(law: str) -> tuple[float, float]:
    high = measured("DMSP-20").pressure >= printed_number("sarosi", "good_from").value * PA_PER_BAR
    residual = fitted_residual(law)
    return rms(residual[high]), rms(residual[~high])


@recomputes("sarosi-15")
def _good_above() -> Recomputed:
    high = measured("DMSP-20").pressure >= printed_number("sarosi", "good_from").value * PA_PER_BAR
    share = _above_and_below("strain")[0] / rms(measured("DMSP-20").force[high])
    return Recomputed(share, holds=share <= 0.05, rms=_above_and_below("strain")[0])


@recomputes("sarosi-16")
def _helps_below() -> Recomputed:
    without, with_mu = _above_and_below("strain"), _above_and_below("corrected")
    gains = [1.0 - b / a for a, b in zip(without, with_mu, strict=True)]
    return Recomputed((gains[1], gains[0]), holds=gains[1] > gains[0])


@recomputes("sarosi-17")
def _better() -> Recomputed:
    old, new = rms(fitted_residual("corrected")), rms(fitted_residual("exponential"))
    return Recomputed((old, new), holds=new < old)


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
    explained = 1.0 - float(np.sum(residual**2) / np.sum((points.force - points.force.mean()) ** 2))
    return Recomputed(explained, holds=explained >= 0.99)
