"""Passive elasticity of tube and braid: a spring that locks on stretch and lets go on contraction.

The tube, with x = kappa_slack - kappa, the stretch beyond the slack point:

    x <= 0:  F = (k/h) (exp(h x) - 1)     the pressure-free part b exp(c kappa) + f of Sarosi (4)
    x > 0:   F = k x

Contracted, it resists with at most k/h, which is what a muscle must overcome before it pulls. Its
kappa is that against the length at which the pressurised muscle is free. Where the braid locks, at
a stretch x_lock of the muscle itself, it adds what makes the whole of an unpressurised muscle the
finitely extensible spring k x / (1 - (x/x_lock)^2) (Warner 1972).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from pamsim.core.parameters import ParameterGroup, parameter

_TANGENT = 0.95
"""Share of the locking stretch beyond which the force goes on along its tangent."""


@dataclass(frozen=True, kw_only=True)
class PassiveSpring(ParameterGroup):
    """Stiffness, softening, locking and slack point of the passive spring; stiffness 0 is none."""

    group: ClassVar[str] = "passive"
    stiffness: float = parameter(
        unit="N", low=0.0, high=1e6, doc="k = -dF/dkappa at the slack point", default=0.0
    )
    softening: float = parameter(
        unit="1",
        low=0.1,
        high=500.0,
        doc="h, e-fold softening per unit of contraction",
        default=1.0,
    )
    slack_contraction: float = parameter(
        unit="1", low=-0.3, high=0.5, doc="contraction at which the spring is free", default=0.0
    )
    locking: float = parameter(
        unit="1", low=0.0, high=200.0, doc="1/x_lock, reciprocal stretch at which the braid locks;"
        " 0 never", default=0.0,
    )  # fmt: skip


def tube_force(
    contraction: float, stiffness: float, softening: float, slack_contraction: float
) -> float:
    """Force of the tube.

    Args:
        contraction: kappa against the length at which the pressurised muscle is free [-].
        stiffness: k [N] per unit of strain at the slack point.
        softening: h [-].
        slack_contraction: kappa at which the force is zero [-].

    Returns:
        Force [N]: positive when stretched beyond the slack point, down to -k/h when contracted.
    """
    stretch = slack_contraction - contraction
    if stretch <= 0.0:
        return stiffness / softening * math.expm1(softening * stretch)
    return stiffness * stretch


def tube_energy(
    contraction: float, force: float, stiffness: float, softening: float, slack_contraction: float
) -> float:
    """Energy that the tube stores, per nominal length [N].

    Zero at the slack point, positive elsewhere; its derivative by contraction is minus the force.

    Args:
        contraction: as for `tube_force`.
        force: `tube_force` there, so that its exponential need not be taken again [N].
        stiffness: k [N].
        softening: h [-].
        slack_contraction: kappa at which the force is zero [-].
    """
    stretch = slack_contraction - contraction
    if stretch <= 0.0:
        return (force - stiffness * stretch) / softening
    return 0.5 * force * stretch


def locking_force(
    contraction: float, stiffness: float, slack_contraction: float, locking: float
) -> float:
    """Force of a stretched braid beyond that of the tube.

    Args:
        contraction: kappa = 1 - l/l0 [-].
        stiffness: k [N] per unit of strain at the slack point.
        slack_contraction: kappa at which the unpressurised muscle is free [-].
        locking: 1/x_lock [-]; 0 for a braid that never locks.

    Returns:
        Force [N], never negative, 0 in contraction. Beyond 95 % of the locking stretch it goes on
        along its tangent, so that it stays finite where an integrator may step.
    """
    stretch = slack_contraction - contraction
    if stretch <= 0.0:
        return 0.0
    share = stretch * locking
    if not share > _TANGENT:  # NaN stays NaN, with a braid that never locks as well
        return stiffness * stretch * share * share / (1.0 - share * share)
    room = 1.0 - _TANGENT * _TANGENT
    edge = _TANGENT / locking
    slope = (1.0 + _TANGENT * _TANGENT) / (room * room)
    return stiffness * (edge / room + slope * (stretch - edge) - stretch)
