"""Preisach operator with the weight of Van Damme 2008, (5), and the pleated muscles' factor.

W[u] is the sum over relays (alpha, beta), beta <= alpha, of weight times relay: up once
u >= alpha, down once u < beta. On a grid of n levels the relays of one row, of equal alpha, are up
in a run that starts at the lowest beta, so n counts hold the state of n (n + 1)/2 relays
(Mayergoyz 2003; the staircase line of Van Damme 2008, figure 13). The memory z holds these counts,
less those of the virgin state. Levels lie at the middle of the n cells of [-1, 1]. Relays of the
diagonal (alpha = beta) carry half a cell. W itself lags the contraction and would give energy; its
distance from the middle of the major loop leads.

The factor is the relative hysteresis of pleated muscles (Van Damme 2008, (6) and (7)),
F = F_static (1 + e), e = delta (W[eps_s] - W_fit(eps_s)), eps_s = 2 eps/eps_max - 1, with W_fit the
straight line through the major loop of W. In the form of all operators here that is w = W_fit - W
with force_share = delta and no other force. The paper does not state the data of the line's fit.
Here it is the least-squares line over eps_s, both branches with equal weight at every eps_s; by
symmetry it passes through the origin.
"""

from __future__ import annotations

import math

from pamsim.core.parameters import quantity
from pamsim.physics.hysteresis.group import Hysteresis, MutableRow, Operator, Row


class Preisach(Hysteresis, law="preisach", count_field="levels"):
    """Grid and weight (5): exp(-(alpha - beta + c)^2 - (|alpha + beta| + d)^2)."""

    levels: float = quantity("[2, 200]", "number n of levels of the grid")
    low_contraction: float = quantity("[-0.5, 0]", "contraction that is the lower saturation", 0.0)
    high_contraction: float = quantity("(0, 1]", "contraction that is the upper saturation", 0.35)
    c: float = quantity("[-2, 2]", "minus the most frequent width of a relay", -0.1)
    d: float = quantity("[-2, 2]", "minus twice the most frequent middle", -1.0)


class PleatedFactor(Preisach, law="pleated_factor"):
    """Fields of `Preisach`; ``force_share`` is delta of the paper, ``high_contraction`` eps_max.

    Printed delta: 0.299 of the muscle with 40 fibres, 0.139 with 25 (Van Damme 2008, III.E).
    """


def levels_reached(levels: int, u: float) -> int:
    """Number of levels that are not above an input u, which is not NaN."""
    return math.floor(min(max(0.5 * (u + 1.0) * levels + 0.5, 0.0), float(levels)))


def virgin_count(levels: int, i: int) -> float:
    """Number of relays [-] that are up in row i of a demagnetised state: alpha + beta < 0.

    The one on the line alpha + beta = 0 is half up, so that the virgin output is exactly neutral.
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


def column(levels: int, j: int, c: float, d: float) -> tuple[float, float, float]:
    """Level beta of a column, and its factors in weight (5) below and above alpha + beta = 0 [-].

    By the weight's symmetry a row's factors are those of the column n - 1 - i: the weight is the
    second of the row times the first of the column below that line, the other way round above it.
    """
    beta = (2.0 * j + 1.0) / levels - 1.0
    minus = math.exp(-2.0 * beta * beta + 2.0 * (d + c) * beta)
    return beta, minus, math.exp(-2.0 * beta * beta - 2.0 * (d - c) * beta)


def row_sum(
    near: float, far: float, minus: float, plus: float, line_minus: float, line_plus: float
) -> float:
    """Sum of a row's weights over columns [-], from its factors and their sums, see `column`.

    Factors are positive, so the smaller of the sums up to a column and up to the line ends first.
    """
    return far * min(minus, line_minus) + near * max(plus - line_plus, 0.0)


def staircase_sums(
    levels: int, c: float, d: float, z: Row, u: float
) -> tuple[float, float, float, float, float, float]:
    """Output of the relays, their major loop and their energy, in one pass over the rows.

    Rows are visited from the highest alpha down, so that every sum over columns that a row needs
    differs by few terms from the one before, and no table is needed: row i meets the line
    alpha + beta = 0 at column n - 1 - i, and the counts of an orderly state rise.

    Between its thresholds, beta < u < alpha, a relay is half a step off its middle, down or up: it
    has taken up u - beta since it went down, or alpha - u since it went up, and gives it back on
    the way there. The rest, alpha - beta in all, is lost as it switches.

    The arguments are n, c and d of weight (5), the memory z and the input u in [-1, 1], or beyond.

    Returns:
        W in [-1, 1]; the middle of the major loop at this input; the half width of the major loop
        in its centre; the slope of the straight line fitted to the major loop; how far the integral
        of the middle over the input u lies below u times the middle; the energy that the relays
        hold. All pure numbers.
    """
    if math.isnan(u):
        return u, u, u, u, u, u
    reached = levels_reached(levels, u)
    # Sums over columns of their two factors, and of u - beta times these: over the columns below
    # the diagonal, over those that the input has reached, up to the line, and up to a row's count.
    minus, plus, reached_minus, reached_plus = 0.0, 0.0, 0.0, 0.0
    for j in range(levels):
        beta, first, second = column(levels, j, c, d)
        minus += first
        plus += second
        if j < reached:
            reached_minus += first * (u - beta)
            reached_plus += second * (u - beta)
    line_minus, line_plus, line_minus_taken, line_plus_taken = 0.0, 0.0, 0.0, 0.0
    up_minus, up_plus, up_minus_taken, up_plus_taken = 0.0, 0.0, 0.0, 0.0
    up, held, total, central, middle, below, moment = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    p = 0
    for step in range(levels):
        i = levels - 1 - step
        alpha, first, second = column(levels, i, c, d)
        minus -= first
        plus -= second
        beta, near, far = column(levels, step, c, d)
        line_minus += near
        line_plus += far
        if step < reached:
            line_minus_taken += near * (u - beta)
            line_plus_taken += far * (u - beta)
        half_minus, half_plus = minus + 0.5 * first, plus + 0.5 * second
        row = row_sum(near, far, half_minus, half_plus, line_minus, line_plus)
        total += row
        moment += row * (1.0 - alpha * alpha)
        if 2 * i + 1 <= levels:
            central += row if 2 * i + 1 == levels else 2.0 * row
        if i < levels - reached:
            middle -= row
            below += row * alpha
        if i < reached:
            middle += row
            below += row * alpha
            up += row
            continue
        count = updated_count(levels, i, z, reached)
        if p > count:  # only if the memory was written by hand: counts rise otherwise
            p, up_minus, up_plus, up_minus_taken, up_plus_taken = 0, 0.0, 0.0, 0.0, 0.0
        while p + 1.0 <= count:
            beta, first, second = column(levels, p, c, d)
            up_minus += first
            up_plus += second
            up_minus_taken += first * (u - beta)
            up_plus_taken += second * (u - beta)
            p += 1
        # Half of a relay in the virgin state; a rounding error elsewhere; NaN stays NaN.
        beta, first, second = column(levels, p, c, d)
        partly = (count - p) * (far * first if p <= step else near * second)
        risen = row_sum(near, far, up_minus, up_plus, line_minus, line_plus)
        up += risen + partly
        held += risen * (alpha - u) + partly * (alpha + beta - 2.0 * u)
        held += row_sum(near, far, reached_minus, reached_plus, line_minus_taken, line_plus_taken)
        held -= row_sum(near, far, up_minus_taken, up_plus_taken, line_minus_taken, line_plus_taken)
    return (
        2.0 * up / total - 1.0,
        middle / total,
        1.0 - central / total,
        1.5 * moment / total,
        below / total,
        held / total,
    )


def scaled_input(h: Preisach, x: float) -> float:
    """Input u [-]: contraction mapped so that its saturations are -1, 1 (Van Damme 2008, (6))."""
    return 2.0 * (x - h.low_contraction) / (h.high_contraction - h.low_contraction) - 1.0


def preisach_output(h: Preisach, z: Row, x: float) -> float:
    """Distance of W below the middle of its major loop over the half width in its centre [-]."""
    u = scaled_input(h, x)
    output, middle, half_width, _, _, _ = staircase_sums(int(h.levels), h.c, h.d, z, u)
    return (middle - output) / half_width


def preisach_energy(h: Preisach, z: Row, x: float) -> float:
    """Energy that the relays hold [contraction]."""
    u = scaled_input(h, x)
    _, _, half_width, _, _, held = staircase_sums(int(h.levels), h.c, h.d, z, u)
    return 0.5 * (h.high_contraction - h.low_contraction) * held / half_width


def preisach_rates(
    h: Preisach, z: Row, dz: MutableRow, x: float, x_rate: float, timestep: float
) -> None:
    """Write the rates [1/s] that move every count to where input x leaves it."""
    levels = int(h.levels)
    reached = 0 if math.isnan(x) else levels_reached(levels, scaled_input(h, x))
    for i in range(levels):
        count = x if math.isnan(x) else updated_count(levels, i, z, reached)
        dz[i] = (count - virgin_count(levels, i) - z[i]) / timestep


def pleated_factor_output(h: PleatedFactor, z: Row, x: float) -> float:
    """W_fit - W of Van Damme 2008, (6): relative loss of force over delta, a pure number.

    Outside the span eps_s counts as -1 or 1, where the paper's model ends.
    """
    u = scaled_input(h, x)
    output, _, _, slope, _, _ = staircase_sums(int(h.levels), h.c, h.d, z, u)
    return slope * min(max(u, -1.0), 1.0) - output


def pleated_factor_energy(h: PleatedFactor, z: Row, x: float) -> float:
    """Energy [contraction] of the relays and of the line's distance from the loop's middle."""
    u = scaled_input(h, x)
    _, middle, _, slope, below, held = staircase_sums(int(h.levels), h.c, h.d, z, u)
    line = abs(u) - 0.5 if abs(u) > 1.0 else 0.5 * u * u
    span = h.high_contraction - h.low_contraction
    return 0.5 * span * (slope * line - (u * middle - below) + held)


PREISACH = Operator(
    name="preisach",
    title="Preisach",
    equation="w = (middle of the major loop - W) / its half width in the centre",
    source="Van Damme 2008, (5); Mayergoyz 2003",
    group=Preisach,
    output=preisach_output,
    energy=preisach_energy,
    rates=preisach_rates,
    rate_independent=True,
    odd=True,
    notes="The output goes in steps of the grid; odd but for inputs that hit a level exactly.",
)

PLEATED_FACTOR = Operator(
    name="pleated_factor",
    title="Pleated-muscle factor",
    equation="w = W_fit(eps_s) - W[eps_s], eps_s = 2 (eps - low)/(high - low) - 1",
    source="Van Damme 2008, (5) to (7)",
    group=PleatedFactor,
    output=pleated_factor_output,
    energy=pleated_factor_energy,
    rates=preisach_rates,
    rate_independent=True,
    odd=True,
    notes="force_share is the paper's delta; the paper trusts it for 7 % to 20 % contraction."
    " A cycle can yield up to delta |w| times its swings of pressure and volume.",
)
