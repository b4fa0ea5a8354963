"""Friction at the joint that is higher at low speed, as a force on the tendon (Stribeck 1902).

Dry friction that does not depend on speed is the joint's own ``frictionloss``, which the engine
solves for; this force is added at low speed:

    f = F (v/v_s) exp((1 - (v/v_s)^2) / 2)

A smooth odd function with its peak F at the speed v_s. It only dissipates energy.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from pamsim.core.parameters import ParameterGroup, parameter


@dataclass(frozen=True, kw_only=True)
class Friction(ParameterGroup):
    """Peak of the friction and its speed; force 0 turns it off."""

    group: ClassVar[str] = "friction"
    stribeck_force: float = parameter(
        unit="N", low=0.0, high=1e4, doc="F, peak of the friction at low speed", default=0.0
    )
    stribeck_velocity: float = parameter(
        unit="m/s",
        low=1e-5,
        high=10.0,
        doc="v_s, tendon speed of the peak; limits the time step",
        default=1e-2,
    )


def stribeck_friction(velocity: float, force: float, stribeck_velocity: float) -> float:
    """Force against the tendon's motion.

    Args:
        velocity: v of the tendon, positive where it lengthens [m/s].
        force: F [N].
        stribeck_velocity: v_s [m/s].

    Returns:
        f [N], of the sign of the velocity.
    """
    share = velocity / stribeck_velocity
    return force * share * math.exp(0.5 * (1.0 - share * share))


def stribeck_damping(force: float, stribeck_velocity: float) -> float:
    """Largest slope of the friction, at rest: F sqrt(e) / v_s.

    Args:
        force: F [N].
        stribeck_velocity: v_s [m/s].

    Returns:
        [N s/m]. On a mass m, explicit time steps longer than m / slope overshoot rest.
    """
    return force * math.exp(0.5) / stribeck_velocity
