"""Equations of the papers in another form, for tests of the laws and operators that have them."""

from __future__ import annotations

import math

import numpy as np

from pamsim.physics.force_laws.exponential import SinglePressureExponential, SixParameter


def isobar(law: SixParameter, pressure: float) -> SinglePressureExponential:
    """The law at one gauge pressure [Pa]: what Sarosi (3) is to (4)."""
    return SinglePressureExponential(
        scale=law.scale,
        a=law.a * pressure + law.b,
        b=law.c,
        d=law.d * pressure,
        e=law.e * pressure + law.f,
    )


def triangle_integral(c: float = -0.1, d: float = -1.0) -> float:
    """Integral of weight (5) of Van Damme 2008 [-] over the triangle -1 <= beta <= alpha <= 1.

    With s = alpha - beta and m = |alpha + beta| the weight is a product of Gauss functions on the
    triangle s + m <= 2; the one over m integrates to error functions, and 40 Gauss-Legendre nodes
    leave no error in the smooth rest.
    """
    nodes, weights = np.polynomial.legendre.leggauss(40)
    root = 0.5 * math.sqrt(math.pi)
    inner = [root * (math.erf(2.0 - s + d) - math.erf(d)) for s in (nodes + 1.0).tolist()]
    outer = np.exp(-((nodes + 1.0 + c) ** 2))
    return float(np.sum(weights * outer * np.array(inner)))
