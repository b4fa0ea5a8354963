"""Passive elasticity of tube and braid: a spring that hardens as the muscle is stretched.

F = (k/h) (exp(h (kappa_slack - kappa)) - 1), the one-sided exponential used for soft tissue (Fung
1967) and, with other letters, for the pressure-free part b exp(c kappa) + f of seed 004 (4). Below
its slack length the spring is taut with stiffness k that grows e-fold per 1/h of stretch; above it,
it resists contraction with at most k/h, which is what a muscle must overcome before it pulls.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from pamsim.core.parameters import ParameterGroup, parameter


@dataclass(frozen=True, kw_only=True)
class HardeningPassive(ParameterGroup):
    """Stiffness, hardening and slack point of the passive spring; stiffness 0 turns it off."""

    group: ClassVar[str] = "passive"
    stiffness: float = parameter(
        unit="N", low=0.0, high=1e6, doc="k = -dF/dkappa at the slack point", default=0.0
    )
    hardening: float = parameter(
        unit="1", low=0.1, high=500.0, doc="h, e-fold hardening per unit of stretch", default=1.0
    )
    slack_contraction: float = parameter(
        unit="1", low=-0.3, high=0.5, doc="contraction at which the spring is free", default=0.0
    )


def hardening_force(
    contraction: float, stiffness: float, hardening: float, slack_contraction: float
) -> float:
    """Passive force of the stretched tube and braid (Fung-type exponential spring).

    Args:
        contraction: kappa = 1 - l/l0 [-].
        stiffness: k [N] per unit of strain at the slack point.
        hardening: h [-].
        slack_contraction: kappa at which the force is zero [-].

    Returns:
        Force [N]: positive when stretched beyond the slack point, down to -k/h when contracted.
    """
    return stiffness / hardening * math.expm1(hardening * (slack_contraction - contraction))
