"""Relative hysteresis of pleated muscles (Van Damme 2008, (6) and (7)).

F = F_static (1 + e), e = delta (W[eps_s] - W_fit(eps_s)), eps_s = 2 eps/eps_max - 1, with W the
Preisach operator of weight (5) and W_fit the straight line through its major loop. In the form of
all operators here that is w = W_fit - W with force_share = delta and no other force.

The paper does not state the data of the line's fit. Here it is the least-squares line over eps_s,
both branches with equal weight at every eps_s; by symmetry it passes through the origin.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from pamsim.physics.hysteresis.group import MutableRow, Row
from pamsim.physics.hysteresis.preisach import (
    Preisach,
    held_by_relays,
    levels_reached,
    preisach_rates,
    scaled_input,
    staircase_sums,
)


@dataclass(frozen=True, kw_only=True)
class PleatedFactor(Preisach):
    """Fields of `Preisach`; ``force_share`` is delta of the paper, ``high_contraction`` eps_max.

    Printed delta: 0.299 of the muscle with 40 fibres, 0.139 with 25 (Van Damme 2008, III.E).
    """

    law: ClassVar[str] = "pleated_factor"


def pleated_factor_output(h: PleatedFactor, z: Row, x: float) -> float:
    """W_fit - W of Van Damme 2008, (6): relative loss of force over delta.

    Args:
        h: parameters.
        z: counts of relays that are up, less those of the virgin state.
        x: contraction eps [-].

    Returns:
        w; outside the span eps_s counts as -1 or 1, where the paper's model ends.
    """
    if math.isnan(x):
        return x
    levels = int(h.levels)
    u = scaled_input(h, x)
    output, _, _, slope, _, _ = staircase_sums(levels, h.c, h.d, z, levels_reached(levels, u))
    return slope * min(max(u, -1.0), 1.0) - output


def pleated_factor_rates(
    h: PleatedFactor, z: Row, dz: MutableRow, x: float, x_rate: float, timestep: float
) -> None:
    """Write the rates [1/s] of the counts as `preisach_rates` does, whose arguments it takes."""
    preisach_rates(h, z, dz, x, x_rate, timestep)


def pleated_factor_energy(h: PleatedFactor, z: Row, x: float) -> float:
    """Energy that the operator holds [contraction]; arguments as `pleated_factor_output`.

    It is that of the relays and of what does not depend on the path, the distance of the straight
    line from the middle of the major loop.
    """
    if math.isnan(x):
        return x
    levels = int(h.levels)
    c, d = h.c, h.d
    u = scaled_input(h, x)
    reached = levels_reached(levels, u)
    _, middle, _, slope, below, total = staircase_sums(levels, c, d, z, reached)
    held = held_by_relays(levels, c, d, z, reached, u) / total
    line = abs(u) - 0.5 if abs(u) > 1.0 else 0.5 * u * u
    return (
        0.5
        * (h.high_contraction - h.low_contraction)
        * (slope * line - (u * middle - below) + held)
    )
