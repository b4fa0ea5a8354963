"""Van Damme 2008, section III.C: the Preisach operator and its weight (5)."""

from __future__ import annotations

import functools
import math

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.papers.claim import (
    AGREES,
    Recomputed,
    agreeing,
    printed_numbers,
    printed_values,
    recomputes,
)
from pamsim.papers.rounding import propagated
from pamsim.papers.vandamme2008.numbers import value
from pamsim.papers.vandamme2008.relays import (
    RelaySum,
    levels_of,
    printed_weight,
    relay_weights,
    triangle_integral,
)
from pamsim.physics.hysteresis.preisach import (
    levels_reached,
    staircase_sums,
    updated_count,
    virgin_count,
)

LEVELS = 40
"""Of the grid of relays."""


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
        result = staircase_sums(n, c, d, act, u)[0]
        act = _moved(n, act, levels_reached(n, u))
        worst = max(worst, abs(result - expected))
    return Recomputed(worst, high=AGREES, n=n)


def _moved(levels: int, act: list[float], reached: int) -> list[float]:
    return [updated_count(levels, i, act, reached) - virgin_count(levels, i) for i in range(levels)]


@recomputes("vandamme2008-12")
def _most_frequent() -> Recomputed:
    c, d = value("weight_c"), value("weight_d")
    fine = np.linspace(-1.0, 1.0, 201).tolist()
    places = [(a, b) for a in fine for b in fine if a + b <= 0.0 and b <= a]
    alpha, beta = max(places, key=lambda place: printed_weight(*place, c, d))
    middle_gap = max(
        abs(printed_weight(a, b, c, d) - printed_weight(-b, -a, c, d)) for a, b in places[::7]
    )
    return Recomputed(
        (alpha - beta, alpha + beta),
        printed=(-c, d),
        **agreeing(-c, d),
        middle_gap=middle_gap,
    )


@recomputes("vandamme2008-13")
def _saturates() -> Recomputed:
    history = relay_history(np.array([1.0, -1.1]))
    result = output(history, _printed_table())
    return Recomputed(result.tolist(), **agreeing(1.0, -1.0))


@recomputes("vandamme2008-14")
def _inside() -> Recomputed:
    rng = np.random.default_rng(0)
    turns = np.concatenate([[1.0, -1.1], rng.uniform(-1.0, 1.0, 40)])
    path = np.interp(np.linspace(0.0, turns.size - 1, 800), np.arange(turns.size), turns)
    w = output(relay_history(path), _printed_table())
    levels = levels_of(LEVELS)
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
    slow, fast = printed_values("vandamme2008", "loop_times")
    step = 0.01
    weights = _printed_table()
    ends: list[FloatArray] = []
    for lasts in (slow, fast):
        phase = np.linspace(0.0, 4.0 * math.pi, 2 * round(lasts / step) + 1)
        w = output(relay_history(np.sin(phase)), weights)
        ends.append(w[:: (len(w) - 1) // 160])
    difference = float(np.max(np.abs(ends[0] - ends[1])))
    return Recomputed(difference, high=AGREES)
