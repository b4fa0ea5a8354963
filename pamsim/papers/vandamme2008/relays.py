"""The Preisach operator by its definition (Van Damme 2008, section III.C), with any weight.

`RelaySum` keeps every relay of a triangular grid and switches it on its own; the engine's operator
(`pamsim.physics.hysteresis.preisach`) gives the same numbers at a cost of order n per step. It
starts demagnetised; a relay with alpha + beta = 0 counts as 0 until it first switches.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from pamsim.core.units import FloatArray


def printed_weight(alpha: float, beta: float, c: float = -0.1, d: float = -1.0) -> float:
    """Weight (5) [-] of Van Damme 2008 without its normalisation, on -1 <= beta <= alpha <= 1."""
    middle = alpha + beta - d if alpha + beta <= 0.0 else alpha + beta + d
    return math.exp(-((beta - alpha - c) ** 2) - middle**2)


def levels_of(count: int) -> FloatArray:
    """Middles of ``count`` equal cells of [-1, 1]: (2 i + 1)/n - 1."""
    return (2.0 * np.arange(count) + 1.0) / count - 1.0


def relay_weights(count: int, weight: Callable[[float, float], float]) -> FloatArray:
    """Weights of the relays of a grid of n levels, from any weight function of (alpha, beta).

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


class RelaySum:
    """The definition: a sum over relays (Van Damme 2008, section III.C), of order n^2 per step.

    ``weights`` (n, n) are those of `relay_weights`, ``relays`` (n, n) the outputs from -1 to 1.
    """

    def __init__(self, weights: FloatArray) -> None:
        order = np.arange(len(weights))
        middle = order[:, None] + order[None, :] - (len(order) - 1)
        self.weights = weights
        self.relays: FloatArray = -np.sign(middle).astype(np.float64)

    def step(self, u: float) -> float:
        """Switch every relay by input u and return the output W."""
        levels = levels_of(len(self.weights))
        risen = u >= levels[:, None]
        fallen = u < levels[None, :]
        self.relays = np.where(risen, 1.0, np.where(fallen, -1.0, self.relays))
        return float(np.sum(self.weights * self.relays))


def major_loop(weights: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Output on both branches at the levels [-]; inputs between levels see no other output."""
    levels = levels_of(len(weights))
    half_cell = 1.0 / len(weights)  # in the middle between two levels no rounding decides
    up, down = RelaySum(weights), RelaySum(weights)
    low = [up.step(-1.1), *(up.step(float(u) + half_cell) for u in levels)]
    high = [down.step(1.1), *(down.step(float(u) - half_cell) for u in levels[::-1])]
    # At a level itself the output jumps: the mean of both sides is the curve's value there.
    rising = 0.5 * (np.array(low[:-1]) + np.array(low[1:]))
    falling = 0.5 * (np.array(high[:-1]) + np.array(high[1:]))
    return rising, falling[::-1]


def line_slope(weights: FloatArray) -> float:
    """Slope [-] of W_fit: least squares on both branches of the major loop, through its middle."""
    levels, branches = levels_of(len(weights)), sum(major_loop(weights))
    return float(levels @ branches) / (2.0 * float(levels @ levels))
