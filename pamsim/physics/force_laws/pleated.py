"""Force of a pleated muscle by its dimensionless force function (Van Damme 2008, (1) and (2)).

F = p l0^2 f_t0(eps), f_t0 = f0 / eps + f1 + f2 eps + f3 eps^2 + f4 eps^3, eps = 1 - l/l0.

The form is a fit, good above 5 % contraction; Van Damme 2008 prints no coefficients.
`SLENDERNESS_6` has those fitted to the exact shape. At and below eps = 0 there is no force: the
membrane cannot be longer than l0, and the law is NaN there so that a run stops. Between 0 and 5 %
the elasticity of the fibres, which the law neglects, limits the real force.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from pamsim.core.parameters import ParameterGroup, parameter


@dataclass(frozen=True, kw_only=True)
class Pleated(ParameterGroup):
    """Coefficients of the dimensionless force function."""

    group: ClassVar[str] = "force"
    law: ClassVar[str] = "pleated"
    scale: float = parameter(
        unit="1", low=0.0, high=5.0, low_open=True, doc="factor on the force", default=1.0
    )
    f0: float = parameter(unit="1", low=-10.0, high=10.0, doc="coefficient of 1/eps")
    f1: float = parameter(unit="1", low=-100.0, high=100.0, doc="constant")
    f2: float = parameter(unit="1", low=-1e3, high=1e3, doc="coefficient of eps")
    f3: float = parameter(unit="1", low=-1e4, high=1e4, doc="coefficient of eps^2")
    f4: float = parameter(unit="1", low=-1e4, high=1e4, doc="coefficient of eps^3")


FIT_RANGE: tuple[float, float] = (0.05, 0.35)
"""Contractions of the fit: from where the law holds to the largest one Van Damme 2008 measures."""

SLENDERNESS_6 = Pleated(
    f0=0.02300273978,
    f1=1.031348789,
    f2=-4.596929223,
    f3=6.726459461,
    f4=-5.078786628,
)
"""Slenderness l0/R = 6, as in Van Damme 2008: fitted to the exact shape, not measured."""


def pleated_function(
    contraction: float, f0: float, f1: float, f2: float, f3: float, f4: float
) -> float:
    """Dimensionless force function f_t0 [-] (Van Damme 2008, equation (2)).

    The arguments are contraction eps = 1 - l/l0 [-] and the fields of `Pleated` after its scale.
    NaN at and below zero contraction.
    """
    if not contraction > 0.0:
        return math.nan
    return f0 / contraction + f1 + contraction * (f2 + contraction * (f3 + contraction * f4))


def pleated_force(
    pressure: float,
    contraction: float,
    f0: float,
    f1: float,
    f2: float,
    f3: float,
    f4: float,
    nominal_length: float,
) -> float:
    """Force of a pleated muscle (Van Damme 2008, equations (1) and (2)).

    The arguments are gauge pressure p [Pa], contraction eps = 1 - l/l0 [-], the fields of `Pleated`
    after its scale, and the length l0 of the membrane [m].

    Returns:
        Force [N], positive when the muscle pulls; not yet limited to tension. NaN for eps <= 0.
    """
    area = nominal_length * nominal_length
    return pressure * area * pleated_function(contraction, f0, f1, f2, f3, f4)


def pleated_volume(
    pressure: float,
    contraction: float,
    f0: float,
    f1: float,
    f2: float,
    f3: float,
    f4: float,
    nominal_length: float,
) -> float:
    """Volume that belongs to `pleated_force`, whose arguments it takes.

    The fitted force has no integral from nominal length, where the exact one goes as 1 / sqrt(eps).
    Up to the lower end of the fit it is continued as such: the volume gained there is 2 eps f_t0.

    Returns:
        Volume gained since nominal length, per nominal length [m^2]. The pressure has no influence.
        NaN for eps <= 0.
    """
    if not contraction > 0.0:
        return math.nan
    start = FIT_RANGE[0]
    gained = 2.0 * start * pleated_function(start, f0, f1, f2, f3, f4)
    gained += f0 * math.log(contraction / start)
    gained += _polynomial_integral(contraction, f1, f2, f3, f4)
    gained -= _polynomial_integral(start, f1, f2, f3, f4)
    return nominal_length * nominal_length * gained


def _polynomial_integral(eps: float, f1: float, f2: float, f3: float, f4: float) -> float:
    """Integral from 0 of f1 + f2 eps + f3 eps^2 + f4 eps^3."""
    return eps * (f1 + eps * (f2 / 2.0 + eps * (f3 / 3.0 + eps * f4 / 4.0)))
