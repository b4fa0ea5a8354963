"""The six-parameter exponential force law fitted to Festo fluidic muscles (Sarosi, equation (4)).

F = (a p + b) exp(c kappa) + d p kappa + e p + f. Sarosi (4) has eight constants,
(a p + b) exp(c kappa + d) + (e p + f) kappa + g p + h: its exp(d) is not identifiable beside a and
b, and its f kappa is left out here; its e, g, h are d, e, f here. With f kappa it is
`pamsim.physics.force_laws.invertible_exponential`. The published constants of the same group
(`pamsim.physics.force_laws.published`) are in the six-parameter form. The p-terms are what the air
does, b exp(c kappa) + f what the rubber does at no pressure.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from pamsim.core.parameters import ParameterGroup, parameter


@dataclass(frozen=True, kw_only=True)
class SixParameter(ParameterGroup):
    """Coefficients in SI; contraction as a fraction (the papers print it in percent)."""

    group: ClassVar[str] = "force"
    law: ClassVar[str] = "six_parameter"
    scale: float = parameter(
        unit="1", low=0.0, high=5.0, low_open=True, doc="factor on the force", default=1.0
    )
    a: float = parameter(unit="N/Pa", low=-1.0, high=1.0, doc="exponential, per pressure")
    b: float = parameter(unit="N", low=-1e4, high=1e4, doc="exponential, without pressure")
    c: float = parameter(unit="1", low=-200.0, high=0.0, doc="decay of the exponential")
    d: float = parameter(unit="N/Pa", low=-1.0, high=1.0, doc="loss with contraction, per pressure")
    e: float = parameter(unit="N/Pa", low=0.0, high=1.0, doc="force per pressure")
    f: float = parameter(unit="N", low=-1e4, high=1e4, doc="force without pressure")


def six_parameter_force(
    pressure: float,
    contraction: float,
    a: float,
    b: float,
    c: float,
    d: float,
    e: float,
    f: float,
) -> float:
    """Force of the six-parameter law (Sarosi, equation (4), its d and f zero).

    The arguments are gauge pressure p [Pa], contraction kappa = 1 - l/l0 [-] and the fields of
    `SixParameter` after its scale.

    Returns:
        Force [N], positive when the muscle pulls; not yet limited to tension.
    """
    decay = math.exp(c * contraction)
    return (a * pressure + b) * decay + d * pressure * contraction + e * pressure + f


def six_parameter_volume(
    pressure: float,
    contraction: float,
    a: float,
    b: float,
    c: float,
    d: float,
    e: float,
    f: float,
) -> float:
    """Volume that belongs to `six_parameter_force`, whose arguments it takes.

    Returns:
        Integral of dF/dp = a exp(c kappa) + d kappa + e from nominal length, the volume gained per
        nominal length [m^2]. The pressure has no influence, nor have b and f.
    """
    return a * _exponential_integral(contraction, c) + contraction * (0.5 * d * contraction + e)


def six_parameter_derivatives(
    pressure: float,
    contraction: float,
    a: float,
    b: float,
    c: float,
    d: float,
    e: float,
    f: float,
) -> tuple[float, float, float, float, float]:
    """Force [N], its derivatives, volume [m^2] and work, as `law_derivatives` returns them.

    In one exponential; arguments as the force's.
    """
    grown = math.expm1(c * contraction)
    swept = contraction if c == 0.0 else grown / c
    per_pressure = a * grown + a + d * contraction + e
    rising = c * (a * pressure + b) * (1.0 + grown) + d * pressure
    gained = a * swept + contraction * (0.5 * d * contraction + e)
    work = pressure * gained + b * swept + f * contraction
    return pressure * per_pressure + b * grown + b + f, rising, per_pressure, gained, work


def six_parameter_elastic_work(contraction: float, b: float, c: float, f: float) -> float:
    """Work of the part without pressure, b exp(c kappa) + f, from nominal length on.

    Per nominal length [N]; the arguments are those of `six_parameter_force`.
    """
    if b == 0.0:
        return f * contraction
    return b * _exponential_integral(contraction, c) + f * contraction


def _exponential_integral(contraction: float, c: float) -> float:
    """Integral of exp(c kappa) from 0; c = 0 makes the exponential 1."""
    return contraction if c == 0.0 else math.expm1(c * contraction) / c
