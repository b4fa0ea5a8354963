"""Creep of tube and braid: one or two Maxwell elements beside the muscle.

With the elasticity that the muscle has already, spring and damper in series make it a standard
linear solid: at a sudden change of length it is stiffer by k, held there it relaxes, and under a
held load it goes on moving. The element's force is k (kappa - kappa_d), with the contraction
kappa_d of its damper as memory. At rest it is free, whatever the contraction. A second one of
another time makes the relaxation faster at first and slower later, as rubber's is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from pamsim.core.parameters import ParameterGroup, parameter


@dataclass(frozen=True, kw_only=True)
class Creep(ParameterGroup):
    """Spring and time constant of each Maxwell element; stiffness 0 is none."""

    group: ClassVar[str] = "creep"
    stiffness: float = parameter(
        unit="N", low=0.0, high=1e6, doc="k, force per sudden change of contraction", default=0.0
    )
    relaxation_time: float = parameter(
        unit="s",
        low=1e-3,
        high=1e4,
        doc="tau, in which the force of a held contraction dies away",
        default=1.0,
    )
    stiffness_2: float = parameter(
        unit="N", low=0.0, high=1e6, doc="k of the second element", default=0.0
    )
    relaxation_time_2: float = parameter(
        unit="s", low=1e-3, high=1e4, doc="tau of the second element", default=10.0
    )


def creep_force(contraction: float, relaxed_contraction: float, stiffness: float) -> float:
    """Force that the element takes from the muscle's pull.

    Args:
        contraction: kappa [-].
        relaxed_contraction: kappa_d, at which the element is free [-].
        stiffness: k [N].

    Returns:
        k (kappa - kappa_d) [N].
    """
    return stiffness * (contraction - relaxed_contraction)


def creep_rate(
    contraction: float, relaxed_contraction: float, relaxation_time: float, timestep: float
) -> float:
    """Rate of the damper's contraction, kappa_d' = (kappa - kappa_d) / tau, over an Euler step.

    Args:
        contraction: kappa [-].
        relaxed_contraction: kappa_d [-].
        relaxation_time: tau [s].
        timestep: [s].

    Returns:
        Rate [1/s] that takes kappa_d in one step to where it is exactly, if kappa stays: stable
        however short the relaxation is.
    """
    return (contraction - relaxed_contraction) * -math.expm1(-timestep / relaxation_time) / timestep
