"""Coefficients of the pleated force function from the exact shape (Van Damme 2008, equation (2)).

Van Damme 2008 says that f0..f4 "are determined by fitting (2) to the theoretical f_t0 or to
measured data" and prints none. Here they are fitted to the theoretical one, for many fibres.
"""

from __future__ import annotations

import numpy as np

from pamsim.core.errors import ParameterError
from pamsim.physics.force_laws.pleated import (
    FIT_RANGE,
    Pleated,
    pleated_function,
    pleated_max_contraction,
    pleated_shape_function,
)


def fit_pleated(
    slenderness: float, contractions: tuple[float, float] = FIT_RANGE, points: int = 400
) -> Pleated:
    """Fit (2) to the exact f_t0 with the least squares of the relative error.

    The points are Chebyshev nodes, which keep the error at the ends of the range as small as
    inside it.

    Args:
        slenderness: l0/R [-].
        contractions: range of the fit, inside the range in which the muscle pulls [-].
        points: number of nodes.

    Returns:
        The coefficients.

    Raises:
        ParameterError: if the muscle does not pull in the whole range.
    """
    low, high = contractions
    angles = (np.arange(points) + 0.5) * np.pi / points
    nodes = low + 0.5 * (high - low) * (1.0 - np.cos(angles))
    exact = np.array([pleated_shape_function(float(node), slenderness) for node in nodes])
    if not np.all(exact > 0.0):  # also where it is NaN
        largest = pleated_max_contraction(slenderness)
        raise ParameterError(
            f"a pleated muscle of slenderness {slenderness:g} does not pull between contractions"
            f" {low:g} and {high:g}; give a range inside (0, {largest:.4g})"
        )
    terms = np.stack([1.0 / nodes, nodes**0, nodes, nodes**2, nodes**3], axis=1)
    solution = np.linalg.lstsq(terms / exact[:, None], np.ones(points), rcond=None)[0]
    f0, f1, f2, f3, f4 = (float(each) for each in solution)
    return Pleated(f0=f0, f1=f1, f2=f2, f3=f3, f4=f4)


def worst_relative_error(
    law: Pleated,
    slenderness: float,
    contractions: tuple[float, float] = FIT_RANGE,
    points: int = 301,
) -> float:
    """Largest |approximate / exact - 1| of f_t0 over a range.

    Args:
        law: coefficients.
        slenderness: l0/R [-].
        contractions: range, ends included [-].
        points: number of equally spaced contractions.

    Returns:
        Worst relative error [-].
    """
    worst = 0.0
    for eps in np.linspace(*contractions, points).tolist():
        exact = pleated_shape_function(eps, slenderness)
        fitted = pleated_function(eps, law.f0, law.f1, law.f2, law.f3, law.f4)
        worst = max(worst, abs(fitted / exact - 1.0))
    return worst
