"""Arctangent branches (Alraouf 2025, (1) and (2)) and an operator that adds partial loops.

The paper fits one branch to rising and one to falling pressure, y = k_0 atan(k_1 p + k_2) + k_3,
and does not state what happens at a reversal in between. `Arctangent` follows Madelung's rules
(Madelung 1905; Brokate and Sprekels 1996): a reversal starts a branch that runs to the previous
turning point; there the inner loop is forgotten and the outer branch continues. The distance of the
new branch from the one it leaves is the width of the major loop, shifted and scaled by the same
factor in both directions to the interval between the two turning points. So every inner loop is a
small image of the major one: the rule adds no parameter, keeps return-point memory, closes every
loop and never reverses its direction, so it generates no energy. Branches that are shifted and
scaled themselves, or cut into pieces, would leave a narrow major loop or reverse loops.

The printed fits do not meet: they are 0.07 mm apart at no pressure and 0.6 mm at 500 kPa, of at
most 5 mm between. The operator makes them meet at both ends of its span. The paper's contraction
lags the pressure; as a force the distance below the middle of the major loop leads.

The memory is a bounded number of turning points: ``z[0]`` is the last input as a fraction t of the
span, ``z[1:]`` the turning points since it was last at an end of the span, 0 for an empty slot: a
turning point is never 0, because there the memory is wiped out. Zeros throughout are an input that
comes from the lower end. A reversal for which no room is left runs back along its own branch, so
loops inside the innermost are lost.
"""

from __future__ import annotations

import math

from pamsim.core.parameters import quantity
from pamsim.physics.hysteresis.group import Hysteresis, MutableRow, Operator, Row

SMALLEST_MOVE = 1e-9
"""Moves below this share of the span are rounding errors of the state, not reversals."""


class Arctangent(Hysteresis, law="arctangent", count_field="turning_points"):
    """Steepness |k_1| (p_high - p_low) and middle of each branch as a fraction of the span."""

    turning_points: float = quantity("[1, 32]", "number of turning points remembered", 8.0)
    low_contraction: float = quantity("[-0.5, 0]", "contraction where the branches meet below", 0.0)
    high_contraction: float = quantity("(0, 1]", "contraction where the branches meet above")
    steepness_rising: float = quantity(
        "[0.1, 50]", "rising branch: steepness over the span", 4.1606
    )
    middle_rising: float = quantity("[0, 1]", "rising branch: place of the steepest point", 0.3221)
    steepness_falling: float = quantity(
        "[0.1, 50]", "falling branch: steepness over the span", 4.41295
    )
    middle_falling: float = quantity(
        "[0, 1]", "falling branch: place of the steepest point", 0.2695
    )

    @property
    def state_count(self) -> int:
        """The last input and the turning points."""
        return 1 + int(self.turning_points)


def kept_and_added(slots: int, z: Row, t: float) -> tuple[int, int]:
    """Number of turning points that stay when the input goes to t, and 1 if a new one is added.

    Turning points alternate, the first is a maximum: with an even number of them the input is on
    a rising branch, which ends at the maximum before last, with an odd number on a falling one.
    """
    count = 0
    while count < slots and z[1 + count] > SMALLEST_MOVE:
        count += 1
    side = 1.0 if count % 2 == 0 else -1.0
    if side * (z[0] - t) > SMALLEST_MOVE:
        if count == 0 and t <= SMALLEST_MOVE:
            return 0, 0  # down to the lower end in one step
        if count == 0 or side * (t - z[count]) > SMALLEST_MOVE:
            return count, 1 if count < slots else 0
        # Back beyond the start of this branch: both close, the branch before them goes on.
        count -= 1
        side = -side
    while count >= 2 and side * (t - z[count - 1]) >= -SMALLEST_MOVE:
        count -= 2
    if count == 1 and t <= SMALLEST_MOVE:
        count = 0
    return count, 0


def span_fraction(h: Arctangent, x: float) -> float:
    """Contraction as a fraction of the span, limited to [0, 1]; NaN stays NaN."""
    t = (x - h.low_contraction) / (h.high_contraction - h.low_contraction)
    if t < 0.0:
        return 0.0
    return 1.0 if t > 1.0 else t


def branch(t: float, steepness: float, middle: float) -> tuple[float, float]:
    """Arctangent branch from 0 at t = 0 to 1 at t = 1, and its integral from 0; pure numbers."""
    low, here, high = -steepness * middle, steepness * (t - middle), steepness * (1.0 - middle)
    start, at, end = math.atan(low), math.atan(here), math.atan(high)
    under = here * at - low * start - 0.5 * math.log((1.0 + here * here) / (1.0 + low * low))
    return (at - start) / (end - start), (under / steepness - start * t) / (end - start)


def half_width(h: Arctangent, t: float) -> tuple[float, float]:
    """Half the distance of the falling branch above the rising one, and its integral [-]."""
    rising, under_rising = branch(t, h.steepness_rising, h.middle_rising)
    falling, under_falling = branch(t, h.steepness_falling, h.middle_falling)
    return 0.5 * (falling - rising), 0.5 * (under_falling - under_rising)


def output_and_energy(h: Arctangent, z: Row, x: float) -> tuple[float, float]:
    """Distance below the middle of the major loop, a pure number, and energy held [contraction].

    The output starts from the rising branch of the major loop between 0 and 1. Every turning point
    narrows the interval and puts the next branch beside the one before by the width of the scaled
    loop. Its unit is the major loop's half width between the steepest points of its branches.

    A loop of a share s of the span costs 2 s^2 times the integral of the half width. That is lost
    on its rising branch, in proportion to the square of the way since the turn; falling branches
    lose nothing. So what is held goes on without a jump where a loop closes.
    """
    spoilt = x
    for k in range(int(h.turning_points) + 1):
        spoilt += z[k]
    if math.isnan(spoilt):
        return math.nan, math.nan
    t = span_fraction(h, x)
    kept, added = kept_and_added(int(h.turning_points), z, t)
    widest, _ = half_width(h, 0.5 * (h.middle_rising + h.middle_falling))
    if widest == 0.0:
        return 0.0, 0.0  # equal branches: there is no loop
    low, high = 0.0, 1.0
    distance, held = half_width(h, t)
    for k in range(kept + added):
        turn = z[1 + k] if k < kept else z[0]
        if k % 2 == 0:
            high = turn
        else:
            low = turn
        side = 2.0 * (high - low) * (-1.0 if k % 2 == 0 else 1.0)
        width, under = half_width(h, (t - low) / (high - low))
        distance += side * width
        held += side * (high - low) * under
    if (kept + added) % 2 == 0:
        held -= 2.0 * (t - low) * (t - low) * half_width(h, 1.0)[1]
    return distance / widest, (h.high_contraction - h.low_contraction) * held / widest


def arctangent_output(h: Arctangent, z: Row, x: float) -> float:
    """Output w, a pure number, see `output_and_energy`."""
    return output_and_energy(h, z, x)[0]


def arctangent_energy(h: Arctangent, z: Row, x: float) -> float:
    """Energy that the operator holds [contraction], see `output_and_energy`."""
    return output_and_energy(h, z, x)[1]


def arctangent_rates(
    h: Arctangent, z: Row, dz: MutableRow, x: float, x_rate: float, timestep: float
) -> None:
    """Write the rates [1/s] that make the memory what input x leaves of it."""
    t = span_fraction(h, x)
    kept, added = kept_and_added(int(h.turning_points), z, t)
    for k in range(int(h.turning_points)):
        point = z[1 + k] if k < kept else 0.0
        if kept <= k < kept + added:
            point = z[0]
        dz[1 + k] = x if math.isnan(x) else (point - z[1 + k]) / timestep
    # Within SMALLEST_MOVE the last input stays, so that a slow reversal adds up until it is seen.
    dz[0] = 0.0 if abs(t - z[0]) <= SMALLEST_MOVE else (t - z[0]) / timestep


CARD = Operator(
    name="arctangent",
    title="Arctangent branches",
    equation="y = k_0 atan(k_1 p + k_2) + k_3 on each branch; w = (middle - y) / half width",
    source="Alraouf 2025, (1) to (4); partial loops by Madelung's rules",
    group=Arctangent,
    output=arctangent_output,
    energy=arctangent_energy,
    rates=arctangent_rates,
    rate_independent=True,
    odd=False,
    notes="Zero memory is a muscle that comes from its lower end. Inner loops are images of the"
    " major one at their own scale, hence not congruent. A reversal beyond the remembered"
    " number of turning points runs back along its own branch.",
)
