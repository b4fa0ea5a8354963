"""Van Damme 2008: the printed muscle, and section II, its force function (1), (2) and the force.

The paper says that f0..f4 of (2) "are determined by fitting (2) to the theoretical f_t0 or to
measured data" and prints none. Here they are fitted to the theoretical one, for many fibres.
"""

from __future__ import annotations

import numpy as np

from pamsim.core.units import PA_PER_BAR, FloatArray
from pamsim.papers.claim import Order, Recomputed, recomputes
from pamsim.papers.numerics import PrintedNumbers, propagated_each, root
from pamsim.physics.force_laws.force_law import coefficients_of
from pamsim.physics.force_laws.pleated import (
    SLENDERNESS_6,
    Pleated,
    pleated_function,
    pleated_max_contraction,
    pleated_shape_function,
)

PERCENT = 1e-2
_NODES = 400

PRINTED = PrintedNumbers("vandamme2008")
value, values, digits = PRINTED.value, PRINTED.values, PRINTED.digits


def length() -> float:
    """Uncontracted length l0 [m]."""
    return value("length") * 1e-2


def pressures() -> tuple[float, ...]:
    """Gauge pressures of the experiments [Pa]."""
    return tuple(p * PA_PER_BAR for p in values("pressures"))


def largest() -> float:
    """eps_max, the contraction mapped to +1 [-]."""
    return value("max_contraction") * PERCENT


def polynomial(contraction: FloatArray, law: Pleated = SLENDERNESS_6) -> FloatArray:
    """Force function (2) [-] at contractions [-]."""
    coefficients = coefficients_of(law)[1:]
    return np.array([pleated_function(eps, *coefficients) for eps in contraction.tolist()])


def exact(contraction: FloatArray, slenderness: float) -> FloatArray:
    """f_t0 [-] of the exact shape at contractions [-]."""
    return np.array([pleated_shape_function(eps, slenderness) for eps in contraction.tolist()])


def _span() -> tuple[float, float]:
    """Contractions in which (2) is used [-]."""
    return value("valid_from") * PERCENT, largest()


def fit_pleated(slenderness: float) -> Pleated:
    """Fit (2) to the exact f_t0 of a slenderness l0/R [-], least squares of the relative error.

    The points are Chebyshev nodes, which keep the error at the ends of the range as small as
    inside it.
    """
    low, high = _span()
    angles = (np.arange(_NODES) + 0.5) * np.pi / _NODES
    nodes = low + 0.5 * (high - low) * (1.0 - np.cos(angles))
    terms = np.stack([1.0 / nodes, nodes**0, nodes, nodes**2, nodes**3], axis=1)
    wanted = exact(nodes, slenderness)[:, None]
    f0, f1, f2, f3, f4 = np.linalg.lstsq(terms / wanted, np.ones(_NODES), rcond=None)[0].tolist()
    return Pleated(f0=f0, f1=f1, f2=f2, f3=f3, f4=f4)


def worst_relative_error(law: Pleated, slenderness: float) -> float:
    """Largest |approximate / exact - 1| of f_t0 [-] over the contractions in which (2) is used."""
    eps = np.linspace(*_span(), 301)
    return float(np.max(np.abs(polynomial(eps, law) / exact(eps, slenderness) - 1.0)))


@recomputes("vandamme2008-01")
def _possible() -> Recomputed:
    return Recomputed(
        pleated_max_contraction(value("slenderness")) / PERCENT,
        low=value("possible_contraction"),
        slender=pleated_max_contraction(1000.0) / PERCENT,
        stout=pleated_max_contraction(2.0) / PERCENT,
    )


@recomputes("vandamme2008-03")
def _polynomial() -> Recomputed:
    slenderness = digits("slenderness")
    law = fit_pleated(slenderness.value)
    # What half a unit of the printed slenderness moves the shape, where it moves it least.
    shape = propagated_each(lambda s: exact(np.linspace(*_span(), 13), s).tolist(), slenderness)
    return Recomputed(
        worst_relative_error(law, slenderness.value) / PERCENT,
        high=min(each.half_unit / each.value for each in shape) / PERCENT,
    )


@recomputes("vandamme2008-04")
def _coefficients() -> tuple[float, ...]:
    return coefficients_of(fit_pleated(value("slenderness")))[1:]


@recomputes("vandamme2008-05")
def _muscle_like() -> Recomputed:
    ends = exact(np.array(_span()), value("slenderness")).tolist()
    return Recomputed(tuple(ends), low=0.0, order=Order.FALLING, factor=ends[0] / ends[1])


@recomputes("vandamme2008-06")
def _below_five_percent() -> float:
    slenderness, eps = value("slenderness"), np.array([0.2 * value("valid_from") * PERCENT])
    fitted = polynomial(eps, fit_pleated(slenderness))
    return float((fitted / exact(eps, slenderness))[0] - 1.0) / PERCENT


@recomputes("vandamme2008-07")
def _imposed_force() -> Recomputed:
    amplitude, offset = digits("force_amplitude"), digits("force_offset")
    return Recomputed(
        propagated_each(lambda a, b: (b - a, b + a), amplitude, offset),
        low=0.0,
        low_half=offset.value - amplitude.value / 2.0,
        high_half=offset.value + amplitude.value / 2.0,
    )


@recomputes("vandamme2008-08")
def _contractions_reached() -> Recomputed:
    slenderness, amplitude, offset = map(value, ("slenderness", "force_amplitude", "force_offset"))

    def reached(force: float, pressure: float) -> float:
        wanted = force / (pressure * length() ** 2)
        return root(
            lambda eps: pleated_shape_function(eps, slenderness) - wanted, 1e-5, 0.45, 1e-12
        )

    lowest = offset - amplitude / 2.0
    return Recomputed(
        tuple(reached(lowest, p) / PERCENT for p in pressures()),
        lowest=lowest,
        at_most=reached(amplitude - offset, max(pressures())) / PERCENT,
    )
