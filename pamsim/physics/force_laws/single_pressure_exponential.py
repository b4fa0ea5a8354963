"""The exponential force law at one pressure (Sarosi, equation (3)).

F = a exp(b kappa) + d kappa + e. The paper writes a exp(b kappa + c): exp(c) is a second factor on
the same term, which no measurement can distinguish from a, so `a` here is the paper's a exp(c). The
law describes one isobar of a force map. It does not know what pressure does: its derivative by
pressure is zero and it has no inverse p(F, kappa).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from pamsim.core.parameters import ParameterGroup, parameter
from pamsim.physics.force_laws.exponential import six_parameter_elastic_work


@dataclass(frozen=True, kw_only=True)
class SinglePressureExponential(ParameterGroup):
    """Coefficients of one isobar, in the letters of the paper without c."""

    group: ClassVar[str] = "force"
    law: ClassVar[str] = "single_pressure_exponential"
    scale: float = parameter(
        unit="1", low=0.0, high=5.0, low_open=True, doc="factor on the force", default=1.0
    )
    a: float = parameter(unit="N", low=-1e4, high=1e4, doc="factor of the exponential")
    b: float = parameter(unit="1", low=-200.0, high=0.0, doc="decay of the exponential")
    d: float = parameter(unit="N", low=-1e5, high=1e5, doc="change with contraction")
    e: float = parameter(unit="N", low=-1e4, high=1e4, doc="force without the exponential")


def single_pressure_force(
    pressure: float, contraction: float, a: float, b: float, d: float, e: float
) -> float:
    """Force on one isobar (Sarosi, equation (3)).

    The arguments are gauge pressure [Pa], which has no influence, contraction kappa = 1 - l/l0 [-]
    and the fields of `SinglePressureExponential` after its scale.

    Returns:
        Force [N], positive when the muscle pulls; not yet limited to tension.
    """
    # 0 p is zero for every pressure and NaN for a lost one, which must not go unnoticed.
    return a * math.exp(b * contraction) + d * contraction + e + 0.0 * pressure


def single_pressure_volume(
    pressure: float, contraction: float, a: float, b: float, d: float, e: float
) -> float:
    """Volume that belongs to `single_pressure_force`, whose arguments it takes.

    Returns:
        0 [m^2]: air that does not change the force does no work, so its volume stays that at
        nominal length. NaN for a lost contraction, which must not go unnoticed.
    """
    return 0.0 * contraction


def single_pressure_work(contraction: float, a: float, b: float, d: float, e: float) -> float:
    """Work from nominal length on, per nominal length [N]; arguments of `single_pressure_force`."""
    return six_parameter_elastic_work(contraction, a, b, e) + 0.5 * d * contraction * contraction
