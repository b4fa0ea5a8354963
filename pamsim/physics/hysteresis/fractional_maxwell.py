"""Fractional Maxwell element (Nguyen 2024, (6) to (16)) as a sum of Maxwell branches.

F + beta^alpha D^alpha F = K_e beta^alpha D^alpha x, with the relaxation function
K_e E_alpha(-(t/beta)^alpha). It is a mixture of exponentials exp(-r t) with a known positive
density over the rate r (Gorenflo and Mainardi 1997), rho = r beta:

    k(r) = r K(r) = sin(alpha pi)/pi  v / (v^2 + 2 v cos(alpha pi) + 1),  v = rho^alpha  per ln r.

The midpoint rule in ln r makes it a finite sum; two more branches carry what lies below and above,
whose weights follow from the closed integral of k. All weights are positive and add up to 1, so
every such sum is passive. With the published alpha = 0.27, beta = 49.82 and the default 16 branches
the relative error of the complex stiffness is below 5e-4 over 0.05 to 50 Hz.
Above alpha = 0.7 the density has a peak at 1/beta that more branches must resolve; near 1, where
the element is a single Maxwell branch, the sum is no good approximation.

The memory z holds the positions q_k of the branches' dashpots [contraction].
"""

from __future__ import annotations

import math

from pamsim.core.parameters import quantity
from pamsim.physics.hysteresis.group import Hysteresis, MutableRow, Operator, Row


class FractionalMaxwell(Hysteresis, law="fractional_maxwell", count_field="branches"):
    """Order and time constant of the element, and the rates of the branches that stand for it."""

    branches: float = quantity("[4, 64]", "number of Maxwell branches", 16.0)
    order: float = quantity("[0.05, 0.95]", "alpha")
    time_constant: float = quantity("[1e-4, 1e4] s", "beta")
    span: float = quantity("(0, 1]", "contraction whose instantaneous response is 1")
    slowest_rate: float = quantity("[1e-6, 1] 1/s", "lower end of the rates r", 3e-3)
    fastest_rate: float = quantity("[10, 1e6] 1/s", "upper end of the rates r", 3e4)


def density(rate: float, order: float, time_constant: float) -> float:
    """Density k per ln r [-] of rate r [1/s], order alpha and time constant beta [s]."""
    v = (rate * time_constant) ** order
    turn = math.pi * order
    return math.sin(turn) / math.pi * v / (v * v + 2.0 * v * math.cos(turn) + 1.0)


def density_slope_and_integral(
    rate: float, order: float, time_constant: float
) -> tuple[float, float]:
    """Derivative of `density` by ln r, and its integral over all rates below r, from 0 to 1 [-]."""
    v = (rate * time_constant) ** order
    turn = math.pi * order
    sine, cosine = math.sin(turn), math.cos(turn)
    divisor = v * v + 2.0 * v * cosine + 1.0
    slope = order * sine / math.pi * v * (1.0 - v * v) / (divisor * divisor)
    # The difference of two arctangents in one, which keeps its digits for small v.
    return slope, math.atan2(v * sine, 1.0 + v * cosine) / turn


def branch_rate(h: FractionalMaxwell, k: int) -> float:
    """Rate of branch k [1/s]: the last two stand for all rates below and above the others.

    They match the tails of the density to first order, r^alpha below and r^-alpha above.
    """
    inner = int(h.branches) - 2
    if k == inner:
        return h.slowest_rate * h.order / (1.0 + h.order)
    if k == inner + 1:
        return h.fastest_rate * (1.0 + h.order) / h.order
    return h.slowest_rate * (h.fastest_rate / h.slowest_rate) ** ((k + 0.5) / inner)


def branch_weight(h: FractionalMaxwell, k: int) -> float:
    """Weight of branch k [-]; all of them add up to 1 but for the midpoint rule's error.

    Cut off at both ends the rule misses h^2/24 times the density's slope there (Euler-Maclaurin),
    which the two outer branches carry.
    """
    inner = int(h.branches) - 2
    width = math.log(h.fastest_rate / h.slowest_rate) / inner
    if k >= inner:
        end = h.slowest_rate if k == inner else h.fastest_rate
        slope, below = density_slope_and_integral(end, h.order, h.time_constant)
        carried = below - width * width / 24.0 * slope
        return carried if k == inner else 1.0 - carried
    return width * density(branch_rate(h, k), h.order, h.time_constant)


def fractional_maxwell_output(h: FractionalMaxwell, z: Row, x: float) -> float:
    """Force of the branches over the instantaneous one at a contraction of ``span``, a ratio."""
    total = 0.0
    for k in range(int(h.branches)):
        total += branch_weight(h, k) * (x - z[k])
    return total / h.span


def fractional_maxwell_energy(h: FractionalMaxwell, z: Row, x: float) -> float:
    """Energy in the branches' springs [contraction]."""
    total = 0.0
    for k in range(int(h.branches)):
        stretch = x - z[k]
        total += 0.5 * branch_weight(h, k) * stretch * stretch
    return total / h.span


def fractional_maxwell_rates(
    h: FractionalMaxwell, z: Row, dz: MutableRow, x: float, x_rate: float, timestep: float
) -> None:
    """Write the mean rates [1/s] of the dashpots over one step of dq/dt = r (x - q).

    Exact for an input that goes on at its rate: explicit Euler would blow up in the fast branches.
    """
    for k in range(int(h.branches)):
        rate = branch_rate(h, k)
        gone = -math.expm1(-rate * timestep)
        dz[k] = (gone * (x - z[k]) + x_rate * (timestep - gone / rate)) / timestep


CARD = Operator(
    name="fractional_maxwell",
    title="Fractional Maxwell",
    equation="F + beta^a D^a F = K_e beta^a D^a x as a sum of Maxwell branches",
    source="Nguyen 2024, (8) and (9); Gorenflo and Mainardi 1997",
    group=FractionalMaxwell,
    output=fractional_maxwell_output,
    energy=fractional_maxwell_energy,
    rates=fractional_maxwell_rates,
    rate_independent=False,
    odd=True,
    notes="Linear, so not limited to [-1, 1]: w = 1 is the instantaneous response to span.",
)
