"""The invertible exponential force law with all its terms (Sarosi, equations (4) and (5)).

F = (a p + b) exp(c kappa) + (e p + f) kappa + g p + h, in the letters of the paper.

The paper has an eighth constant, d, in exp(c kappa + d). It is fixed at 0 here: exp(d) only
multiplies a and b, so any d gives the same forces with other a and b, and a fit of all eight has no
unique answer. Where a d is printed, a exp(d) and b exp(d) are the a and b of this law. What remains
is the six-parameter law (`pamsim.physics.force_laws.exponential`) and one term more, f kappa:
elasticity without pressure that is linear in contraction. The six-parameter law is this one with f
= 0.

The force is linear in pressure, which is what makes it invertible in closed form (5).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from pamsim.core.parameters import ParameterGroup, parameter
from pamsim.physics.force_laws.exponential import (
    six_parameter_elastic_work,
    six_parameter_force,
    six_parameter_volume,
)


@dataclass(frozen=True, kw_only=True)
class InvertibleExponential(ParameterGroup):
    """Coefficients in SI, in the letters of the paper without d."""

    group: ClassVar[str] = "force"
    law: ClassVar[str] = "invertible_exponential"
    scale: float = parameter(
        unit="1", low=0.0, high=5.0, low_open=True, doc="factor on the force", default=1.0
    )
    a: float = parameter(unit="N/Pa", low=-1.0, high=1.0, doc="exponential, per pressure")
    b: float = parameter(unit="N", low=-1e4, high=1e4, doc="exponential, without pressure")
    c: float = parameter(unit="1", low=-200.0, high=0.0, doc="decay of the exponential")
    e: float = parameter(unit="N/Pa", low=-1.0, high=1.0, doc="loss with contraction, per pressure")
    f: float = parameter(unit="N", low=-1e5, high=1e5, doc="change with contraction, no pressure")
    g: float = parameter(unit="N/Pa", low=0.0, high=1.0, doc="force per pressure")
    h: float = parameter(unit="N", low=-1e4, high=1e4, doc="force without pressure")


def invertible_exponential_force(
    pressure: float,
    contraction: float,
    a: float,
    b: float,
    c: float,
    e: float,
    f: float,
    g: float,
    h: float,
) -> float:
    """Force of the invertible law (Sarosi, equation (4) with d = 0).

    The arguments are gauge pressure p [Pa], contraction kappa = 1 - l/l0 [-] and the fields of
    `InvertibleExponential` after its scale.

    Returns:
        Force [N], positive when the muscle pulls; not yet limited to tension.
    """
    return six_parameter_force(pressure, contraction, a, b, c, e, g, h) + f * contraction


def invertible_exponential_volume(
    pressure: float,
    contraction: float,
    a: float,
    b: float,
    c: float,
    e: float,
    f: float,
    g: float,
    h: float,
) -> float:
    """Volume that belongs to `invertible_exponential_force`, whose arguments it takes.

    Returns:
        Volume gained since nominal length, per nominal length [m^2]: that of the six-parameter law.
    """
    return six_parameter_volume(pressure, contraction, a, b, c, e, g, h)


def invertible_exponential_elastic_work(
    contraction: float, b: float, c: float, f: float, h: float
) -> float:
    """Work of the part without pressure from nominal length on, per nominal length [N].

    The arguments are those of `invertible_exponential_force`.
    """
    elastic = six_parameter_elastic_work(contraction, b, c, h)
    return elastic + 0.5 * f * contraction * contraction
