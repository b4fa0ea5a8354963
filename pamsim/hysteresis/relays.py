"""Preisach operators on a triangular grid with any weight, for analysis.

`RelaySum` is the definition: every relay is kept and switched on its own. `Staircase` keeps one
count per level and gives the same numbers at a cost of order n per step (Mayergoyz 2003). Both
start demagnetised; a relay with alpha + beta = 0 counts as 0 until it first switches.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def printed_weight(alpha: float, beta: float, c: float = -0.1, d: float = -1.0) -> float:
    """Weight (5) [-] of Van Damme 2008 without its normalisation, on -1 <= beta <= alpha <= 1."""
    middle = alpha + beta - d if alpha + beta <= 0.0 else alpha + beta + d
    return math.exp(-((beta - alpha - c) ** 2) - middle**2)


def normalised_weight(alpha: float, beta: float, c: float = -0.1, d: float = -1.0) -> float:
    """Weight (5) [-] of Van Damme 2008 divided by `triangle_integral`."""
    return printed_weight(alpha, beta, c, d) / triangle_integral(c, d)


def triangle_integral(c: float = -0.1, d: float = -1.0) -> float:
    """Integral of weight (5) [-] over the triangle -1 <= beta <= alpha <= 1.

    With s = alpha - beta and m = |alpha + beta| the weight is a product of Gauss functions on the
    triangle s + m <= 2; the one over m integrates to error functions, and 40 Gauss-Legendre nodes
    leave no error in the smooth rest.
    """
    nodes, weights = np.polynomial.legendre.leggauss(40)
    root = 0.5 * math.sqrt(math.pi)
    inner = [root * (math.erf(2.0 - s + d) - math.erf(d)) for s in (nodes + 1.0).tolist()]
    outer = np.exp(-((nodes + 1.0 + c) ** 2))
    return float(np.sum(weights * outer * np.array(inner)))


def levels_of(count: int) -> Array:
    """Middles of ``count`` equal cells of [-1, 1]: (2 i + 1)/n - 1."""
    return (2.0 * np.arange(count) + 1.0) / count - 1.0


def relay_weights(count: int, weight: Callable[[float, float], float]) -> Array:
    """Weights of the relays of a grid, from any weight function of (alpha, beta).

    Args:
        count: number n of levels.
        weight: not negative.

    Returns:
        (n, n) weights, row alpha, column beta, zero above the diagonal, sum 1. Relays of the
        diagonal stand for half a cell.
    """
    levels = [float(level) for level in levels_of(count)]
    table = np.zeros((count, count))
    for i, alpha in enumerate(levels):
        for j in range(i + 1):
            table[i, j] = weight(alpha, levels[j]) * (0.5 if i == j else 1.0)
    return table / table.sum()


@dataclass
class RelaySum:
    """The definition: a sum over relays (Van Damme 2008, section III.C), of order n^2 per step.

    Attributes:
        weights: (n, n) from `relay_weights`.
        relays: (n, n) outputs of the relays, from -1 to 1.
    """

    weights: Array
    relays: Array = field(init=False)

    def __post_init__(self) -> None:
        """Demagnetise."""
        order = np.arange(len(self.weights))
        middle = order[:, None] + order[None, :] - (len(order) - 1)
        self.relays = -np.sign(middle).astype(np.float64)

    def step(self, u: float) -> float:
        """Switch every relay by input u and return the output W."""
        levels = levels_of(len(self.weights))
        risen = u >= levels[:, None]
        fallen = u < levels[None, :]
        self.relays = np.where(risen, 1.0, np.where(fallen, -1.0, self.relays))
        return float(np.sum(self.weights * self.relays))


@dataclass
class Staircase:
    """The same operator by its staircase: one count per level, of order n per step.

    Attributes:
        weights: (n, n) from `relay_weights`.
        halves: half relays that are up in each row; odd only in the virgin state.
    """

    weights: Array
    halves: list[int] = field(init=False)
    _table: list[list[float]] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Demagnetise, and tabulate the weights' sums."""
        n = len(self.weights)
        self.halves = [min(2 * i + 2, 2 * (n - i) - 1) for i in range(n)]
        self._table = staircase_table(self.weights).tolist()

    def step(self, u: float) -> float:
        """Move the staircase by input u and return the output W."""
        return staircase_step(self._table, self.halves, u)


def staircase_table(weights: Array) -> Array:
    """Output of the first rows by the number of half relays that are up in each, a pure number.

    Args:
        weights: (n, n) from `relay_weights`.

    Returns:
        (2 n + 1, n + 1) sums, by half relays and number of rows. A row has no more relays than its
        place, so that 2 n stands for all of them.
    """
    n = len(weights)
    table = np.zeros((2 * n + 1, n + 1))
    table[0, 1:] = -weights.sum(axis=1)
    table[1:, 1:] = np.repeat(weights.T, 2, axis=0)
    return np.cumsum(np.cumsum(table, axis=0), axis=1)


def staircase_step(
    table: Sequence[Sequence[float]] | Array, halves: list[int] | NDArray[np.int64], u: float
) -> float:
    """One step of a staircase, plain enough to be compiled.

    Rows of equal count are added up in one go: only the corners of the staircase cost a look-up.

    Args:
        table: (2 n + 1, n + 1) from `staircase_table`.
        halves: (n,) half relays that are up in each row, changed in place.
        u: input; not NaN.

    Returns:
        W, the sum over the rows, a pure number.
    """
    n = len(halves)
    reached = math.floor(min(max(0.5 * (u + 1.0) * n + 0.5, 0.0), float(n)))
    for i in range(reached):
        halves[i] = 2 * i + 2
    before = 2 * n
    total = 0.0
    for i in range(reached, n):
        count = min(halves[i], 2 * reached)
        halves[i] = count
        if count != before:
            total += table[before][i] - table[count][i]
            before = count
    return total + table[before][n]
