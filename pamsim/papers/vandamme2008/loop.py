"""Van Damme 2008, section III: Preisach operator with weight (5), relative error (6), force (7).

The operator by its definition: `RelaySum` keeps every relay of a triangular grid and switches it on
its own; the engine's operator (`pamsim.physics.hysteresis.preisach`) gives the same numbers at a
cost of order n per step. It starts demagnetised; a relay with alpha + beta = 0 counts as 0 until it
first switches. After it stands whether a loop determines delta, c and d.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.papers.claim import AGREES, Recomputed, recomputes
from pamsim.papers.numerics import least_squares, propagated
from pamsim.papers.vandamme2008.shape import PERCENT, PRINTED, digits, largest, value, values
from pamsim.recordings.printed import Printed

LEVELS = 40
"""Of the grid of relays."""
_NOISE = 0.02
"""Of the force, one standard deviation over the force itself."""
_SEEDS = 20
_FAR = np.array([0.2, -0.3, -0.7])
"""Start of a fit of delta, c and d, away from all printed numbers."""


def printed_weight(alpha: float, beta: float, c: float = -0.1, d: float = -1.0) -> float:
    """Weight (5) [-] of Van Damme 2008 without its normalisation, on -1 <= beta <= alpha <= 1."""
    middle = alpha + beta - d if alpha + beta <= 0.0 else alpha + beta + d
    return math.exp(-((beta - alpha - c) ** 2) - middle**2)


def levels_of(count: int) -> FloatArray:
    """Middles of ``count`` equal cells of [-1, 1]: (2 i + 1)/n - 1."""
    return (2.0 * np.arange(count) + 1.0) / count - 1.0


def relay_weights(count: int, weight: Callable[[float, float], float]) -> FloatArray:
    """Weights (n, n) of the relays of a grid of n levels, row alpha, column beta, sum 1.

    They are zero above the diagonal; relays of the diagonal stand for half a cell.
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


def weight_table(c: float, d: float) -> FloatArray:
    """Normalised weights (5) of the relays, (LEVELS, LEVELS)."""
    return relay_weights(LEVELS, lambda alpha, beta: printed_weight(alpha, beta, c, d))


def relay_history(inputs: FloatArray) -> FloatArray:
    """Outputs of all relays along a path of inputs in [-1, 1], (samples, LEVELS, LEVELS)."""
    relays = RelaySum(np.zeros((LEVELS, LEVELS)))
    states: list[FloatArray] = []
    for u in inputs.tolist():
        relays.step(u)
        states.append(relays.relays)
    return np.array(states)


def output(history: FloatArray, weights: FloatArray) -> FloatArray:
    """W along a path [-]."""
    return np.tensordot(history, weights, axes=2)


@recomputes("vandamme2008-15")
def _speed_ratio() -> Printed:
    return propagated(lambda slow, fast: slow / fast, *PRINTED.all_digits("loop_times"))


@functools.cache
def path() -> FloatArray:
    """Contractions of the generated record [-]."""
    turns = [0.05, 0.35, 0.05, 0.35, 0.1, 0.3, 0.12, 0.25, 0.07, 0.2, 0.07, 0.2]
    return np.interp(np.linspace(0.0, len(turns) - 1, 300), np.arange(len(turns)), turns)


def scaled(contraction: FloatArray) -> FloatArray:
    """Scaled contraction eps_s of (6) [-]."""
    return 2.0 * contraction / largest() - 1.0


@functools.cache
def history() -> FloatArray:
    """Outputs of the relays along the generated record, from -1 to 1."""
    return relay_history(scaled(path()))


@functools.cache
def _major() -> tuple[FloatArray, FloatArray]:
    """Input and relays of one major loop, both branches."""
    rise = np.linspace(-1.0, 1.0, 121)
    u = np.concatenate([[1.0, -1.1], rise, rise[::-1]])
    return u[2:], relay_history(u)[2:]


def _line(weights: FloatArray) -> tuple[float, float]:
    """Slope and start of W_fit, the line through the major loop [-]."""
    u, major = _major()
    slope, start = np.polyfit(u, output(major, weights), 1)
    return float(slope), float(start)


def relative_error(values: FloatArray, relays: FloatArray, u: FloatArray) -> FloatArray:
    """Relative error (6) [-] of delta, c and d [-], by `relay_history` and eps_s of one path."""
    weights = weight_table(float(values[1]), float(values[2]))
    slope, start = _line(weights)
    return values[0] * (output(relays, weights) - (slope * u + start))


def _digits(fibres: int) -> list[Printed]:
    return [digits(name) for name in (f"delta_{fibres}", "weight_c", "weight_d")]


def printed_parameters(fibres: int) -> FloatArray:
    """Printed delta, c and d of the muscle with 40 or 25 fibres [-]."""
    return np.array([number.value for number in _digits(fibres)])


def _error(fibres: int) -> FloatArray:
    """Relative error (6) along the generated record [-].

    That is the force (7) over its law without memory, less 1, at any pressure.
    """
    return relative_error(printed_parameters(fibres), history(), scaled(path()))


@recomputes("vandamme2008-18")
def _through_the_middle() -> tuple[float, float]:
    return _line(weight_table(value("weight_c"), value("weight_d")))


@recomputes("vandamme2008-19")
def _loses_energy() -> Recomputed:
    u, major = _major()
    error, half = relative_error(printed_parameters(40), major, u), len(u) // 2
    gap = error[half:][::-1] - error[:half]  # falling less rising branch
    return Recomputed((float(gap.min()), float(gap.max())), low=(-AGREES, AGREES))


@recomputes("vandamme2008-22")
def _good_range() -> tuple[float, float]:
    low, high = (number * PERCENT for number in values("good_range"))
    error = _error(40)[(path() >= low) & (path() <= high)]
    return float(np.min(error)) / PERCENT, float(np.max(error)) / PERCENT


def _fit(measured: FloatArray, start: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Fit delta, c and d to a relative error of the force, and half their 95 % intervals."""
    relays, u, bounds = history(), scaled(path()), ([0.0, -1.0, -1.9], [1.0, 0.5, 0.0])
    return least_squares(
        lambda *v: relative_error(np.array(v), relays, u), measured, start, bounds=bounds
    )


@recomputes("vandamme2008-25")
def _recovered() -> Recomputed:
    result = [_fit(_error(fibres), _FAR)[0] for fibres in (40, 25)]
    return Recomputed(np.concatenate(result).tolist(), printed=_digits(40) + _digits(25))


@recomputes("vandamme2008-26")
def _digits_of_delta() -> Recomputed:
    clean = 1.0 + _error(40)
    planted, inside, half = printed_parameters(40), np.zeros(3), np.zeros(3)
    for seed in range(_SEEDS):
        noise = np.random.default_rng(seed).standard_normal(clean.size)
        # Started where it ends without noise: vandamme2008-25 shows that a far start leads there.
        values, width = _fit(clean * (1.0 + _NOISE * noise) - 1.0, planted)
        inside += np.abs(values - planted) <= width
        half += width / _SEEDS
    digit = digits("delta_40").half_unit
    return Recomputed(
        float(half[0]),
        high=digit,
        digit=digit,
        noise=100.0 * _NOISE,
        records=_SEEDS,
        covered=", ".join(f"{share:.2f}" for share in inside / _SEEDS),
    )
