"""Sarosi, the constants of (3) and (4), the inverse (5) and where the published law ends."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from pamsim.core.units import PA_PER_BAR
from pamsim.muscles.exponential import six_parameter_force, six_parameter_force_dp
from pamsim.muscles.invertible_exponential import InvertibleExponential
from pamsim.muscles.published import PUBLISHED
from pamsim.papers.claim import Recomputed, printed_numbers, recomputes
from pamsim.papers.numerics import jacobian, root

FloatArray = NDArray[np.float64]
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


@recomputes("sarosi-09")
def _inverse() -> Recomputed:
    law, worst, least = InvertibleExponential.from_six_parameter(PUBLISHED[_TYPE]), 0.0, math.inf
    a, b, c, e, f, g, h = law.a, law.b, law.c, law.e, law.f, law.g, law.h
    for bar in _BARS:
        for kappa in np.linspace(0.0, 0.25, 26).tolist():
            p, rise = bar * PA_PER_BAR, math.exp(c * kappa)
            force = (a * p + b) * rise + (e * p + f) * kappa + g * p + h
            inverted = -(-force + b * rise + kappa * f + h) / (a * rise + kappa * e + g)
            worst = max(worst, abs(inverted - p))
            slope = six_parameter_force_dp(p, kappa, a, b, c, e, g, h)
            least = min(least, slope * PA_PER_BAR)
    return Recomputed(worst / PA_PER_BAR, least=least)


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
    low, high = numbers[0].value - numbers[0].half_unit, numbers[1].value + numbers[1].half_unit
    return Recomputed(result / _PERCENT, holds=low <= result / _PERCENT <= high)
