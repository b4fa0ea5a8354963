"""Van Damme 2008, section III: Preisach operator with weight (5), relative error (6), force (7).

After them stands whether a loop determines delta, c and d.
"""

from __future__ import annotations

import functools
import math

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.papers.claim import (
    AGREES,
    Order,
    Recomputed,
    agreeing,
    printed_numbers,
    printed_values,
    recomputes,
)
from pamsim.papers.numerics import least_squares, propagated
from pamsim.papers.vandamme2008.relays import (
    RelaySum,
    levels_of,
    printed_weight,
    relay_weights,
    triangle_integral,
)
from pamsim.papers.vandamme2008.shape import (
    PERCENT,
    digits,
    largest,
    length,
    polynomial,
    pressures,
    value,
)
from pamsim.physics.hysteresis.preisach import (
    levels_reached,
    staircase_sums,
    updated_count,
    virgin_count,
)
from pamsim.recordings.printed import Printed

LEVELS = 40
"""Of the grid of relays."""
_NOISE = 0.02
"""Of the force, one standard deviation over the force itself."""
_SEEDS = 20
_FAR = np.array([0.2, -0.3, -0.7])
"""Start of a fit of delta, c and d, away from all printed numbers."""


def weight_table(c: float, d: float) -> FloatArray:
    """Normalised weights (5) of the relays, (LEVELS, LEVELS)."""
    return relay_weights(LEVELS, lambda alpha, beta: printed_weight(alpha, beta, c, d))


@functools.cache
def _printed_table() -> FloatArray:
    return weight_table(value("weight_c"), value("weight_d"))


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


@recomputes("vandamme2008-10")
def _normalised() -> Recomputed:
    c, d = value("weight_c"), value("weight_d")
    nodes, share = np.polynomial.legendre.leggauss(60)
    total = 0.0
    # Over alpha and, below it, beta: cut at alpha + beta = 0, where (5) has a kink.
    for alpha, a in zip(nodes.tolist(), share.tolist(), strict=True):
        for low, high in ((-1.0, min(-alpha, alpha)), (min(-alpha, alpha), alpha)):
            half = 0.5 * (high - low)
            for t, b in zip(nodes.tolist(), share.tolist(), strict=True):
                beta = low + half * (t + 1.0)
                total += a * b * half * printed_weight(alpha, beta, c, d)
    integral = triangle_integral(c, d)
    return Recomputed(total / integral, **agreeing(1.0), integral=integral)


@recomputes("vandamme2008-11")
def _grid() -> Recomputed:
    c, d, n = value("weight_c"), value("weight_d"), LEVELS
    path = np.concatenate([np.linspace(0.0, 1.0, 60), np.linspace(1.0, -1.0, 90)])
    by_relays = output(relay_history(path), _printed_table())
    act = [0.0] * n
    worst = 0.0
    for u, expected in zip(path.tolist(), by_relays.tolist(), strict=True):
        result, reached = staircase_sums(n, c, d, act, u)[0], levels_reached(n, u)
        act = [updated_count(n, i, act, reached) - virgin_count(n, i) for i in range(n)]
        worst = max(worst, abs(result - expected))
    return Recomputed(worst, high=AGREES, n=n)


@recomputes("vandamme2008-12")
def _most_frequent() -> Recomputed:
    c, d = value("weight_c"), value("weight_d")
    fine = np.linspace(-1.0, 1.0, 201).tolist()
    places = [(a, b) for a in fine for b in fine if a + b <= 0.0 and b <= a]
    alpha, beta = max(places, key=lambda place: printed_weight(*place, c, d))
    middle_gap = max(
        abs(printed_weight(a, b, c, d) - printed_weight(-b, -a, c, d)) for a, b in places[::7]
    )
    found, wanted = (alpha - beta, alpha + beta), (-c, d)
    return Recomputed(found, printed=wanted, **agreeing(*wanted), middle_gap=middle_gap)


@recomputes("vandamme2008-13")
def _saturates() -> Recomputed:
    result = output(relay_history(np.array([1.0, -1.1])), _printed_table())
    return Recomputed(result.tolist(), **agreeing(1.0, -1.0))


@recomputes("vandamme2008-14")
def _inside() -> Recomputed:
    rng = np.random.default_rng(0)
    turns = np.concatenate([[1.0, -1.1], rng.uniform(-1.0, 1.0, 40)])
    path = np.interp(np.linspace(0.0, turns.size - 1, 800), np.arange(turns.size), turns)
    w, levels = output(relay_history(path), _printed_table()), levels_of(LEVELS)
    rising = relay_history(np.concatenate([[-1.1], levels]))[1:]
    falling = relay_history(np.concatenate([[1.0], levels[::-1] - 1e-9]))[1:]
    lower, upper = output(rising, _printed_table()), output(falling, _printed_table())[::-1]
    # Between two levels the output stands still: the loop's branches are steps.
    below = np.concatenate([[-1.0], lower])
    above = np.concatenate([upper, [1.0]])
    reached = np.array([levels_reached(LEVELS, u) for u in path.tolist()])
    outside = float(np.max(np.maximum(below[reached] - w, w - above[reached])))
    return Recomputed(max(outside, 0.0), high=AGREES)


@recomputes("vandamme2008-15")
def _speed_ratio() -> Recomputed:
    times = printed_numbers("vandamme2008", "loop_times")
    return Recomputed(propagated(lambda slow, fast: slow / fast, *times))


@recomputes("vandamme2008-16")
def _rate_independent() -> Recomputed:
    step, ends = 0.01, list[FloatArray]()
    for lasts in printed_values("vandamme2008", "loop_times"):
        phase = np.linspace(0.0, 4.0 * math.pi, 2 * round(lasts / step) + 1)
        w = output(relay_history(np.sin(phase)), _printed_table())
        ends.append(w[:: (len(w) - 1) // 160])
    return Recomputed(float(np.max(np.abs(ends[0] - ends[1]))), high=AGREES)


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
    """Relative error (6) along the generated record [-]."""
    return relative_error(printed_parameters(fibres), history(), scaled(path()))


def _force(fibres: int, pressure: float) -> FloatArray:
    """Force (7) along the generated record [N], f0 to f4 from the exact shape."""
    return pressure * length() ** 2 * polynomial(path()) * (1.0 + _error(fibres))


def _gap(fibres: int) -> FloatArray:
    """Falling less rising branch of e over the major loop [-]."""
    u, major = _major()
    error, half = relative_error(printed_parameters(fibres), major, u), len(u) // 2
    return error[half:][::-1] - error[:half]


@recomputes("vandamme2008-17")
def _mapping() -> Recomputed:
    ends = scaled(np.array([0.0, largest()]))
    return Recomputed(ends.tolist(), **agreeing(-1.0, 1.0))


@recomputes("vandamme2008-18")
def _through_the_middle() -> Recomputed:
    return Recomputed(_line(_printed_table()))


@recomputes("vandamme2008-19")
def _loses_energy() -> Recomputed:
    gap = _gap(40)
    return Recomputed((float(gap.min()), float(gap.max())), low=(-AGREES, AGREES))


@recomputes("vandamme2008-20")
def _pressure_independent() -> Recomputed:
    loops = [_force(40, p) / (p * length() ** 2) for p in pressures()]
    spread = max(float(np.max(np.abs(loop / loops[0] - 1.0))) for loop in loops)
    return Recomputed(spread, high=AGREES)


@recomputes("vandamme2008-21")
def _less_pronounced() -> Recomputed:
    narrow, wide = (float(np.max(_gap(fibres))) / PERCENT for fibres in (25, 40))
    return Recomputed((narrow, wide), order=Order.RISING, factor=wide / narrow)


@recomputes("vandamme2008-22")
def _good_range() -> Recomputed:
    low, high = (number * PERCENT for number in printed_values("vandamme2008", "good_range"))
    error = _error(40)[(path() >= low) & (path() <= high)]
    return Recomputed((float(np.min(error)) / PERCENT, float(np.max(error)) / PERCENT))


def _fit(measured: FloatArray, start: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Fit delta, c and d to a relative error of the force, and half their 95 % intervals."""
    relays, u, bounds = history(), scaled(path()), ([0.0, -1.0, -1.9], [1.0, 0.5, 0.0])
    return least_squares(
        lambda *v: relative_error(np.array(v), relays, u), measured, start, bounds=bounds
    )


def _measured_ratio(fibres: int) -> FloatArray:
    """f_t0 of the generated record over its fit, at the pressure the paper fits at, 1.5 bar [-]."""
    pressure = pressures()[1]
    return _force(fibres, pressure) / (pressure * length() ** 2) / polynomial(path())


@recomputes("vandamme2008-25")
def _recovered() -> Recomputed:
    result = [_fit(_measured_ratio(fibres) - 1.0, _FAR)[0] for fibres in (40, 25)]
    return Recomputed(np.concatenate(result).tolist(), printed=_digits(40) + _digits(25))


@recomputes("vandamme2008-26")
def _digits_of_delta() -> Recomputed:
    clean = _measured_ratio(40)
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
