"""Bouc-Wen hysteresis in its normalised form (Ikhouane and Rodellar 2007).

dz/dt = (dx/dt) / D * (1 - |z|^n (sigma sign(z dx/dt) + 1 - sigma)), |z| <= 1. The normalised form
has no redundant parameter and is rate-independent. The muscle pulls less while it shortens than
while it lengthens, so z, with x = kappa, is the output of the operator as it stands.
"""

from __future__ import annotations

import math
from types import MappingProxyType

from pamsim.core.parameters import quantity
from pamsim.physics.hysteresis.group import Hysteresis, MutableRow, Operator, Row


class BoucWen(Hysteresis, law="bouc_wen", states=1):
    """Half-width of the force loop and the travel that turns it over; width 0 turns it off."""

    # Loops of fluidic muscles turn over within a few millimetres.
    usual = MappingProxyType({"yield_contraction": 5e-3})
    yield_contraction: float = quantity("(0, 0.5]", "travel D that turns the loop over")
    sigma: float = quantity("[0.5, 10]", "shape: 0.5 unloads along the initial slope", 0.5)
    sharpness: float = quantity("[1, 20]", "exponent n of the knee", 1.0)


def bouc_wen_rate(
    z: float, velocity: float, yield_travel: float, sigma: float, sharpness: float
) -> float:
    """Rate dz/dt [1/s] of the internal variable z in [-1, 1], from the rate of the input [1/s].

    The travel D is in units of the input; sigma >= 1/2, below which the model is not passive, and
    n >= 1 are its shape.
    """
    blocked = abs(z) ** sharpness
    if not z * velocity > 0.0:
        blocked *= 1.0 - 2.0 * sigma
    return velocity / yield_travel * (1.0 - blocked)


def bouc_wen_output(h: BoucWen, z: Row, x: float) -> float:
    """The internal variable, in [-1, 1], which follows its rate and needs no update."""
    return x if math.isnan(x) else z[0]


def bouc_wen_rates(
    h: BoucWen, z: Row, dz: MutableRow, x: float, x_rate: float, timestep: float
) -> None:
    """Write dz/dt [1/s], see `bouc_wen_rate`."""
    dz[0] = bouc_wen_rate(z[0], x_rate, h.yield_contraction, h.sigma, h.sharpness)


def bouc_wen_energy(h: BoucWen, z: Row, x: float) -> float:
    """Energy that the operator holds, D z^2 / 2 [contraction].

    Unloading gives back at most this much: with sigma >= 1/2 the rest of z dx is never negative.
    """
    return 0.5 * h.yield_contraction * z[0] * z[0]


CARD = Operator(
    name="bouc_wen",
    title="Bouc-Wen",
    equation="dz/dt = x'/D (1 - |z|^n (sigma sign(z x') + 1 - sigma)), w = z",
    source="Ikhouane and Rodellar 2007, normalised form",
    group=BoucWen,
    output=bouc_wen_output,
    energy=bouc_wen_energy,
    rates=bouc_wen_rates,
    rate_independent=True,
    odd=True,
    notes="Small loops inside a large one do not close, they drift: no return-point memory and"
    " no wiping-out. Explicit Euler is rate-independent only as far as its steps are small"
    " against D.",
)
