"""Bouc-Wen hysteresis in its normalised form (Ikhouane and Rodellar 2007).

dz/dt = (dx/dt) / D * (1 - |z|^n (sigma sign(z dx/dt) + 1 - sigma)), |z| <= 1. The normalised form
has no redundant parameter and is rate-independent. The muscle pulls less while it shortens than
while it lengthens, so its force carries -(F_0 + F_p p) z with x = kappa.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from pamsim.core.parameters import ParameterGroup, parameter


@dataclass(frozen=True, kw_only=True)
class BoucWen(ParameterGroup):
    """Half-width of the force loop and the travel that turns it over; width 0 turns it off."""

    group: ClassVar[str] = "hysteresis"
    law: ClassVar[str] = "bouc_wen"
    states: ClassVar[int] = 1
    force: float = parameter(
        unit="N", low=0.0, high=1e3, doc="half-width without pressure", default=0.0
    )
    force_per_pressure: float = parameter(
        unit="N/Pa", low=0.0, high=1e-2, doc="half-width per gauge pressure", default=0.0
    )
    yield_contraction: float = parameter(
        unit="1", low=0.0, high=0.5, low_open=True, doc="travel D that turns the loop over"
    )
    sigma: float = parameter(
        unit="1", low=0.5, high=10.0, doc="shape: 0.5 unloads along the initial slope", default=0.5
    )
    sharpness: float = parameter(
        unit="1", low=1.0, high=20.0, doc="exponent n of the knee", default=1.0
    )


def bouc_wen_rate(
    z: float, velocity: float, yield_travel: float, sigma: float, sharpness: float
) -> float:
    """Rate of the internal variable (Ikhouane and Rodellar 2007, normalised Bouc-Wen model).

    Args:
        z: internal variable, in [-1, 1].
        velocity: rate of the input, here d(kappa)/dt [1/s].
        yield_travel: D, in units of the input.
        sigma: shape, >= 1/2 (below it the model is not passive).
        sharpness: n >= 1.

    Returns:
        dz/dt [1/s].
    """
    size = abs(z) ** sharpness
    along = sigma * size + (1.0 - sigma) * size
    against = -sigma * size + (1.0 - sigma) * size
    blocked = along if z * velocity > 0.0 else against
    return velocity / yield_travel * (1.0 - blocked)
