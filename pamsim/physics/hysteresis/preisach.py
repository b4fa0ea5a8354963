"""Preisach operator with the weight of Van Damme 2008, (5), run by its staircase.

W[u] is the sum over relays (alpha, beta), beta <= alpha, of weight times relay: up once
u >= alpha, down once u < beta. On a grid of n levels the relays of one row, of equal alpha, are up
in a run that starts at the lowest beta, so n counts hold the state of n (n + 1)/2 relays
(Mayergoyz 2003; the staircase line of Van Damme 2008, figure 13).

Levels lie at the middle of the n cells of [-1, 1]. Relays of the diagonal (alpha = beta) carry
half a cell. Weight (5) is a product of a factor of alpha and one of beta on each side of
alpha + beta = 0, which is what makes a step cost of order n without any table.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from pamsim.core.parameters import parameter
from pamsim.physics.hysteresis.group import Hysteresis, MutableRow, Row


@dataclass(frozen=True, kw_only=True)
class Preisach(Hysteresis):
    """Grid and weight (5): exp(-(alpha - beta + c)^2 - (|alpha + beta| + d)^2)."""

    law: ClassVar[str] = "preisach"
    count_field: ClassVar[str] = "levels"
    levels: float = parameter(unit="1", low=2.0, high=200.0, doc="number n of levels of the grid")
    low_contraction: float = parameter(
        unit="1", low=-0.5, high=0.0, doc="contraction that is the lower saturation", default=0.0
    )
    high_contraction: float = parameter(
        unit="1",
        low=0.0,
        high=1.0,
        low_open=True,
        doc="contraction that is the upper saturation",
        default=0.35,
    )
    c: float = parameter(
        unit="1", low=-2.0, high=2.0, doc="minus the most frequent width of a relay", default=-0.1
    )
    d: float = parameter(
        unit="1", low=-2.0, high=2.0, doc="minus twice the most frequent middle", default=-1.0
    )


def upper_factor(t: float, c: float, d: float) -> float:
    """Factor of alpha in weight (5) where alpha + beta >= 0 [-], up to a constant."""
    return math.exp(-2.0 * t * t - 2.0 * (d + c) * t)


def lower_factor(t: float, c: float, d: float) -> float:
    """Factor of beta in weight (5) where alpha + beta >= 0 [-], up to a constant."""
    return math.exp(-2.0 * t * t - 2.0 * (d - c) * t)


def levels_reached(levels: int, u: float) -> int:
    """Number of levels that are not above input u in [-1, 1]; any u but NaN is allowed."""
    scaled = 0.5 * (u + 1.0) * levels + 0.5
    if scaled <= 0.0:
        return 0
    if scaled >= levels:
        return levels
    return math.floor(scaled)


def virgin_count(levels: int, i: int) -> float:
    """Number of relays [-] that are up in row i of a demagnetised state.

    Relays of alpha + beta < 0 are up, the others down. The one with alpha + beta = 0 is half up:
    it sits on the line, and so the virgin output is exactly neutral.
    """
    return min(i + 1.0, levels - i - 0.5)


def updated_count(levels: int, i: int, z: Row, reached: int) -> float:
    """Number of relays [-] that are up in row i once the input has reached a number of levels."""
    count = virgin_count(levels, i) + z[i]
    if reached > i:
        return i + 1.0
    if count > reached:
        return float(reached)
    return count


def staircase_sums(
    levels: int, c: float, d: float, z: Row, reached: int
) -> tuple[float, float, float, float, float, float]:
    """Output of the relays and of their major loop, in one pass over the rows.

    Rows are visited from the highest alpha down, so that every sum over beta that a row needs
    differs by few terms from the one before: row i meets the line alpha + beta = 0 at column
    n - 1 - i, and the counts of an orderly state rise.

    Args:
        levels: n.
        c: of weight (5).
        d: of weight (5).
        z: counts of relays that are up, less those of the virgin state.
        reached: levels that the input has reached, see `levels_reached`.

    Returns:
        W in [-1, 1]; the middle of the major loop at this input; the half width of the major loop
        in its centre; the slope of the straight line fitted to the major loop; how far the integral
        of the middle over the input u lies below u times the middle; the weight of all relays.
    """
    # Sums over j of the weight's factor of beta below some column: *_minus with the form that holds
    # for alpha + beta <= 0, *_plus with the other. By the weight's symmetry the factor of beta at
    # column j in the first form is the factor of alpha at n - 1 - j in the second.
    full_minus = 0.0  # below the diagonal, column i
    full_plus = 0.0
    for j in range(levels):
        t = (2.0 * j + 1.0) / levels - 1.0
        full_minus += upper_factor(t, c, d)
        full_plus += lower_factor(t, c, d)
    line_minus = 0.0  # up to and with the column of alpha + beta = 0
    line_plus = 0.0
    part_minus = 0.0  # below column p
    part_plus = 0.0
    p = 0
    up = 0.0
    total = 0.0
    moment = 0.0
    below = 0.0
    rising = 0.0
    falling = 0.0
    central = 0.0
    for step in range(levels):
        i = levels - 1 - step
        t = (2.0 * i + 1.0) / levels - 1.0
        upper = upper_factor(t, c, d)
        lower = lower_factor(t, c, d)
        upper_mirror = upper_factor(-t, c, d)
        lower_mirror = lower_factor(-t, c, d)
        full_minus -= upper_mirror
        full_plus -= lower
        line_minus += upper
        line_plus += lower_mirror
        if i <= step:
            row = lower_mirror * (full_minus + 0.5 * upper_mirror)
        else:
            row = lower_mirror * line_minus + upper * (full_plus - line_plus + 0.5 * lower)
        count = updated_count(levels, i, z, reached)
        if count >= i + 1.0:
            up += row
        else:
            while p + 1.0 <= count:
                s = (2.0 * p + 1.0) / levels - 1.0
                part_minus += upper_factor(-s, c, d)
                part_plus += lower_factor(s, c, d)
                p += 1
            while p > count:  # only if the memory was written by hand: counts rise otherwise
                p -= 1
                s = (2.0 * p + 1.0) / levels - 1.0
                part_minus -= upper_factor(-s, c, d)
                part_plus -= lower_factor(s, c, d)
            # Half of a relay in the virgin state; a rounding error elsewhere; NaN stays NaN.
            over = count - p
            s = (2.0 * p + 1.0) / levels - 1.0
            if count <= step + 1.0:
                up += lower_mirror * (part_minus + over * upper_factor(-s, c, d))
            else:
                plus = part_plus - line_plus + over * lower_factor(s, c, d)
                up += lower_mirror * line_minus + upper * plus
        total += row
        moment += row * (1.0 - t * t)
        if i < reached:
            rising += row
            below += row * t
        if i < levels - reached:
            falling += row
            below += row * t
        if 2 * i + 1 < levels:
            central += 2.0 * row
        elif 2 * i + 1 == levels:
            central += row
    return (
        2.0 * up / total - 1.0,
        (rising - falling) / total,
        1.0 - central / total,
        1.5 * moment / total,
        below / total,
        total,
    )


def scaled_input(h: Preisach, x: float) -> float:
    """Input u [-]: contraction mapped so that its saturations are -1, 1 (Van Damme 2008, (6))."""
    return 2.0 * (x - h.low_contraction) / (h.high_contraction - h.low_contraction) - 1.0


def preisach_output(h: Preisach, z: Row, x: float) -> float:
    """Distance of the Preisach output below the middle of its major loop.

    W itself lags the contraction and would give energy; its distance to the middle leads.

    Args:
        h: parameters.
        z: counts of relays that are up, less those of the virgin state.
        x: contraction [-].

    Returns:
        w in units of the major loop's half width in its centre: +1 there while contracting.
    """
    if math.isnan(x):
        return x
    levels = int(h.levels)
    reached = levels_reached(levels, scaled_input(h, x))
    output, middle, half_width, _, _, _ = staircase_sums(levels, h.c, h.d, z, reached)
    return (middle - output) / half_width


def preisach_rates(
    h: Preisach, z: Row, dz: MutableRow, x: float, x_rate: float, timestep: float
) -> None:
    """Write the rates that move every count to where input x leaves it.

    Args:
        h: parameters.
        z: counts of relays that are up, less those of the virgin state.
        dz: (levels,) written [1/s].
        x: contraction [-].
        x_rate: not used; the operator does not know time.
        timestep: of the explicit Euler step [s].
    """
    levels = int(h.levels)
    reached = 0 if math.isnan(x) else levels_reached(levels, scaled_input(h, x))
    for i in range(levels):
        count = x if math.isnan(x) else updated_count(levels, i, z, reached)
        dz[i] = (count - virgin_count(levels, i) - z[i]) / timestep


def held_by_relays(levels: int, c: float, d: float, z: Row, reached: int, u: float) -> float:
    """Energy that the relays hold, times their total weight [-].

    Between its thresholds, beta < u < alpha, a relay is half a step off its middle, down or up: it
    has taken up u - beta since it went down, or alpha - u since it went up, and gives it back on
    the way there. The rest, alpha - beta in all, is lost as it switches.

    Args:
        levels: n.
        c: of weight (5).
        d: of weight (5).
        z: counts of relays that are up, less those of the virgin state.
        reached: levels that the input has reached, see `levels_reached`.
        u: input [-].
    """
    # Sums over columns of the weight's factor of beta, and of beta times it, with the two forms of
    # `staircase_sums`: over all that are reached, up to the line alpha + beta = 0, and over those
    # that are up. The last two grow from row to row.
    all_plus = 0.0
    all_plus_beta = 0.0
    for j in range(reached):
        beta = (2.0 * j + 1.0) / levels - 1.0
        all_plus += lower_factor(beta, c, d)
        all_plus_beta += beta * lower_factor(beta, c, d)
    line_minus = 0.0
    line_minus_beta = 0.0
    line_plus = 0.0
    line_plus_beta = 0.0
    up_minus = 0.0
    up_minus_beta = 0.0
    up_plus = 0.0
    up_plus_beta = 0.0
    p = 0
    total = 0.0
    for step in range(levels - reached):
        i = levels - 1 - step
        alpha = (2.0 * i + 1.0) / levels - 1.0
        upper = upper_factor(alpha, c, d)
        lower = lower_factor(-alpha, c, d)
        count = updated_count(levels, i, z, reached)
        while p + 1.0 <= count:
            beta = (2.0 * p + 1.0) / levels - 1.0
            up_minus += upper_factor(-beta, c, d)
            up_minus_beta += beta * upper_factor(-beta, c, d)
            up_plus += lower_factor(beta, c, d)
            up_plus_beta += beta * lower_factor(beta, c, d)
            p += 1
        while p > 0 and p > count:  # only if the memory was written by hand
            p -= 1
            beta = (2.0 * p + 1.0) / levels - 1.0
            up_minus -= upper_factor(-beta, c, d)
            up_minus_beta -= beta * upper_factor(-beta, c, d)
            up_plus -= lower_factor(beta, c, d)
            up_plus_beta -= beta * lower_factor(beta, c, d)
        if p < step:
            risen = lower * up_minus
            fallen = lower * (u * (line_minus - up_minus) - (line_minus_beta - up_minus_beta))
            fallen += upper * (u * (all_plus - line_plus) - (all_plus_beta - line_plus_beta))
        else:
            risen = lower * line_minus + upper * (up_plus - line_plus)
            fallen = upper * (u * (all_plus - up_plus) - (all_plus_beta - up_plus_beta))
        # A relay that is partly up, as those of the virgin state on the line are; NaN stays NaN.
        partly = max(count - p, 0.0)
        beta = (2.0 * p + 1.0) / levels - 1.0
        weight = 0.0
        if p < reached:
            weight = upper * lower_factor(beta, c, d)
            if p < step:
                weight = lower * upper_factor(-beta, c, d)
        total += risen * (alpha - u) + fallen + partly * weight * (alpha + beta - 2.0 * u)
        if step < reached:  # the line's column of the next row
            beta = (2.0 * step + 1.0) / levels - 1.0
            line_minus += upper_factor(-beta, c, d)
            line_minus_beta += beta * upper_factor(-beta, c, d)
            line_plus += lower_factor(beta, c, d)
            line_plus_beta += beta * lower_factor(beta, c, d)
    return total


def preisach_energy(h: Preisach, z: Row, x: float) -> float:
    """Energy that the relays hold [contraction]; the arguments are those of `preisach_output`."""
    if math.isnan(x):
        return x
    levels = int(h.levels)
    c, d = h.c, h.d
    u = scaled_input(h, x)
    reached = levels_reached(levels, u)
    _, _, half_width, _, _, total = staircase_sums(levels, c, d, z, reached)
    held = held_by_relays(levels, c, d, z, reached, u) / total
    return 0.5 * (h.high_contraction - h.low_contraction) * held / half_width
