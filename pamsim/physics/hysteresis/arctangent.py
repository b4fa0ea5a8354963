"""Arctangent branches (Alraouf 2025, (1) and (2)) and an operator that adds partial loops.

The paper fits one branch to rising and one to falling pressure, y = k_0 atan(k_1 p + k_2) + k_3,
and does not state what happens at a reversal in between. `Arctangent` follows Madelung's rules
(Madelung 1905; Brokate and Sprekels 1996): a reversal starts a branch that runs to the previous
turning point; there the inner loop is forgotten and the outer branch continues. The distance of the
new branch from the one it leaves is the width of the major loop, shifted and scaled by the same
factor in both directions to the interval between the two turning points. So every inner loop is a
small image of the major one: the rule adds no parameter, keeps return-point memory, closes every
loop and never reverses its direction, so it generates no energy. Shifting and scaling the branches
themselves would place inner branches far outside a narrow major loop; pieces cut out of them would
reverse loops in their tails.

The printed fits do not meet: they are 0.07 mm apart at no pressure and 0.6 mm at 500 kPa, of at
most 5 mm between. The operator makes them meet at both ends of its span.

Memory: the last input and a bounded number of turning points, as fractions of the span. A reversal
for which no room is left runs back along its own branch, so loops inside the innermost are lost.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from pamsim.core.parameters import parameter
from pamsim.physics.hysteresis.group import Hysteresis, MutableRow, Row
from pamsim.physics.hysteresis.madelung import SMALLEST_MOVE, kept_and_added


@dataclass(frozen=True, kw_only=True)
class Arctangent(Hysteresis):
    """Steepness |k_1| (p_high - p_low) and middle of each branch as a fraction of the span."""

    law: ClassVar[str] = "arctangent"
    count_field: ClassVar[str] = "turning_points"
    turning_points: float = parameter(
        unit="1", low=1.0, high=32.0, doc="number of turning points remembered", default=8.0
    )
    low_contraction: float = parameter(
        unit="1", low=-0.5, high=0.0, doc="contraction where the branches meet below", default=0.0
    )
    high_contraction: float = parameter(
        unit="1",
        low=0.0,
        high=1.0,
        low_open=True,
        doc="contraction where the branches meet above",
    )
    steepness_rising: float = parameter(
        unit="1", low=0.1, high=50.0, doc="rising branch: steepness over the span", default=4.1606
    )
    middle_rising: float = parameter(
        unit="1",
        low=0.0,
        high=1.0,
        doc="rising branch: place of the steepest point",
        default=0.3221,
    )
    steepness_falling: float = parameter(
        unit="1", low=0.1, high=50.0, doc="falling branch: steepness over the span", default=4.41295
    )
    middle_falling: float = parameter(
        unit="1",
        low=0.0,
        high=1.0,
        doc="falling branch: place of the steepest point",
        default=0.2695,
    )

    @property
    def state_count(self) -> int:
        """The last input and the turning points."""
        return 1 + int(self.turning_points)


def branch_shape(t: float, steepness: float, middle: float) -> float:
    """Arctangent branch scaled to run from 0 at t = 0 to 1 at t = 1, a pure number."""
    start = math.atan(-steepness * middle)
    end = math.atan(steepness * (1.0 - middle))
    return (math.atan(steepness * (t - middle)) - start) / (end - start)


def span_fraction(h: Arctangent, x: float) -> float:
    """Contraction as a fraction of the span, limited to [0, 1]; NaN stays NaN."""
    t = (x - h.low_contraction) / (h.high_contraction - h.low_contraction)
    if t < 0.0:
        return 0.0
    return 1.0 if t > 1.0 else t


def half_width(h: Arctangent, t: float) -> float:
    """Half the distance of the falling branch above the rising one, a pure number."""
    rising = branch_shape(t, h.steepness_rising, h.middle_rising)
    return 0.5 * (branch_shape(t, h.steepness_falling, h.middle_falling) - rising)


def branch_integral(t: float, steepness: float, middle: float) -> float:
    """Integral of `branch_shape` from 0 to t, a pure number."""
    low, high = -steepness * middle, steepness * (1.0 - middle)
    here = steepness * (t - middle)
    start, end = math.atan(low), math.atan(high)
    under = here * math.atan(here) - low * start
    under -= 0.5 * math.log((1.0 + here * here) / (1.0 + low * low))
    return (under / steepness - start * t) / (end - start)


def half_width_integral(h: Arctangent, t: float) -> float:
    """Integral of `half_width` from 0 to t, a pure number."""
    rising = branch_integral(t, h.steepness_rising, h.middle_rising)
    return 0.5 * (branch_integral(t, h.steepness_falling, h.middle_falling) - rising)


def distance_to_middle(h: Arctangent, z: Row, t: float, kept: int, added: int) -> float:
    """Distance of the output below the middle of the major loop at t, a pure number.

    It starts from the rising branch of the major loop between 0 and 1. Every turning point narrows
    the interval and puts the next branch beside the one before by the width of the scaled loop.
    """
    low = 0.0
    high = 1.0
    distance = half_width(h, t)
    for k in range(kept + added):
        turn = z[1 + k] if k < kept else z[0]
        if k % 2 == 0:
            high = turn
            side = -2.0
        else:
            low = turn
            side = 2.0
        size = high - low
        distance += side * size * half_width(h, (t - low) / size)
    return distance


def arctangent_output(h: Arctangent, z: Row, x: float) -> float:
    """Distance of the operator below the middle of its major loop.

    The paper's contraction lags the pressure; as a force the distance to the middle leads.

    Args:
        h: parameters.
        z: last input and turning points, as fractions of the span; 0 is an empty slot.
        x: contraction [-].

    Returns:
        w in units of the major loop's half width between the steepest points of its branches.
    """
    for k in range(int(h.turning_points) + 1):
        if math.isnan(z[k]):
            return math.nan
    if math.isnan(x):
        return x
    t = span_fraction(h, x)
    kept, added = kept_and_added(int(h.turning_points), z, t)
    widest = half_width(h, 0.5 * (h.middle_rising + h.middle_falling))
    if widest == 0.0:
        return 0.0  # equal branches: there is no loop
    return distance_to_middle(h, z, t, kept, added) / widest


def arctangent_rates(
    h: Arctangent, z: Row, dz: MutableRow, x: float, x_rate: float, timestep: float
) -> None:
    """Write the rates that make the memory what input x leaves of it.

    Args:
        h: parameters.
        z: last input and turning points, as fractions of the span; 0 is an empty slot.
        dz: (1 + turning_points,) written [1/s].
        x: contraction [-].
        x_rate: not used; the operator does not know time.
        timestep: of the explicit Euler step [s].
    """
    slots = int(h.turning_points)
    if math.isnan(x):
        for k in range(slots + 1):
            dz[k] = x
        return
    t = span_fraction(h, x)
    kept, added = kept_and_added(int(h.turning_points), z, t)
    for k in range(slots):
        if k < kept:
            dz[1 + k] = 0.0
        elif k < kept + added:
            dz[1 + k] = (z[0] - z[1 + k]) / timestep
        else:
            dz[1 + k] = (0.0 - z[1 + k]) / timestep
    # Within SMALLEST_MOVE the last input stays, so that a slow reversal adds up until it is seen.
    moved = abs(t - z[0]) > SMALLEST_MOVE
    dz[0] = (t - z[0]) / timestep if moved else 0.0


def arctangent_energy(h: Arctangent, z: Row, x: float) -> float:
    """Energy that the operator holds [contraction]; the arguments are those of `arctangent_output`.

    A loop of a share s of the span costs 2 s^2 times the integral of the half width. That is lost
    on its rising branch, in proportion to the square of the way since the turn; falling branches
    lose nothing. So what is held goes on without a jump where a loop closes.
    """
    if math.isnan(x):
        return x
    t = span_fraction(h, x)
    kept, added = kept_and_added(int(h.turning_points), z, t)
    widest = half_width(h, 0.5 * (h.middle_rising + h.middle_falling))
    if widest == 0.0:
        return 0.0
    low = 0.0
    high = 1.0
    held = half_width_integral(h, t)
    for k in range(kept + added):
        turn = z[1 + k] if k < kept else z[0]
        if k % 2 == 0:
            high = turn
            side = -2.0
        else:
            low = turn
            side = 2.0
        size = high - low
        held += side * size * size * half_width_integral(h, (t - low) / size)
    if (kept + added) % 2 == 0:
        held -= 2.0 * (t - low) * (t - low) * half_width_integral(h, 1.0)
    return (h.high_contraction - h.low_contraction) * held / widest
