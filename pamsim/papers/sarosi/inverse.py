"""Sarosi, the constants of (3) and (4), the inverse (5) and where the published law ends."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from pamsim.core.units import PA_PER_BAR, FloatArray
from pamsim.papers.claim import AGREES, Recomputed, printed_numbers, recomputes
from pamsim.papers.numerics import jacobian, root
from pamsim.physics.force_laws.exponential import SixParameter, six_parameter_force
from pamsim.physics.force_laws.published import PUBLISHED

Form = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]

_PERCENT = 1e-2
_BARS = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
_TYPE = "DMSP-20-200"
"""The muscle of Sarosi."""
_ONE_PRESSURE = (280.0, -30.0, 0.5, -900.0, -20.0)
_ALL_PRESSURES = (-4.0, 280.0, -30.0, 0.5, -900.0, 50.0, 290.0, -270.0)
"""Where the derivatives are taken: of the size of the published constants, p in bar."""


def _single(v: FloatArray, p: FloatArray, kappa: FloatArray) -> FloatArray:
    a, b, c, d, e = v
    return a * np.exp(b * kappa + c) + d * kappa + e


def _both(v: FloatArray, p: FloatArray, kappa: FloatArray) -> FloatArray:
    a, b, c, d, e, f, g, h = v
    return (a * p + b) * np.exp(c * kappa + d) + (e * p + f) * kappa + g * p + h


@recomputes("sarosi-07", _single, _ONE_PRESSURE)
@recomputes("sarosi-08", _both, _ALL_PRESSURES)
def _rank(law: Form, place: tuple[float, ...]) -> Recomputed:
    p, kappa = (axis.ravel() for axis in np.meshgrid(_BARS, np.linspace(0.0, 0.25, 11)))
    columns = jacobian(lambda v: law(v, p, kappa), place)
    columns /= np.linalg.norm(columns, axis=0)
    rank = int(np.linalg.matrix_rank(columns, tol=1e-6))
    return Recomputed(float(rank))


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
    law, worst, least = PUBLISHED[_TYPE], 0.0, math.inf
    for bar in _BARS:
        for kappa in np.linspace(0.0, 0.25, 26).tolist():
            p = bar * PA_PER_BAR
            force = six_parameter_force(p, kappa, law.a, law.b, law.c, law.d, law.e, law.f)
            worst = max(worst, abs(pressure_for(law, force, kappa) - p))
            least = min(least, _per_pressure(law, kappa) * PA_PER_BAR)
    return Recomputed(worst / PA_PER_BAR, high=AGREES * max(_BARS), least=least)


@recomputes("sarosi-11")
def _published_largest() -> Recomputed:
    law, numbers = PUBLISHED[_TYPE], printed_numbers("sarosi", "max_contraction")
    pressure = _BARS[-1] * PA_PER_BAR
    result = root(
        lambda k: six_parameter_force(pressure, k, law.a, law.b, law.c, law.d, law.e, law.f),
        0.1,
        0.4,
        1e-12,
    )
    low, high = numbers
    return Recomputed(result / _PERCENT, low=low, high=high)
