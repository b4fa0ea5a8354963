"""Section 3: whether the cost (16) and the water cycle algorithm determine the element."""

from __future__ import annotations

import functools
import math

import numpy as np
from numpy.typing import NDArray

from pamsim.fitting.loop_cost import MAXWELL, maxwell_residual
from pamsim.fitting.search_comparison import SearchRun, compare_searches
from pamsim.fitting.water_cycle import water_cycle
from pamsim.papers.claim import Claim, Verdict, compare, holds
from pamsim.papers.nguyen2024.numbers import element, identification_loops, value
from pamsim.papers.printed_number import printed_number

FloatArray = NDArray[np.float64]

_BOX = ((0.01, 0.99), (1.0, 200.0), (1e2, 1e4))
"""Of alpha [-], beta [s], Ke [N/m], round the printed numbers; the paper prints no box."""
_SHARE = 0.01
"""Relative deviation that counts as recovered."""
_SEEDS = range(5)
_NOISE = 0.01
_GENERATED = (
    "ten loops at 1 to 10 Hz and 150 N generated from the printed numbers, in place of the measured"
    " ones, which are not printed"
)


def claims() -> list[Claim]:
    """Claims C-27 to C-33."""
    return [
        _measured(),
        *(
            _recovered(f"C-{28 + i}", method)
            for i, method in enumerate(("least_squares", "differential_evolution", "water_cycle"))
        ),
        _converged(),
        _digits(),
        _shares(),
    ]


def _measured() -> Claim:
    return Claim(
        id="C-27",
        what="alpha, beta and Ke of the measured muscle",
        printed=element(),
        recomputed=None,
        unit="1, s, N/m",
        verdict=Verdict.NOT_REPRODUCIBLE,
        reason="(16) needs x1 and x2 of ten measured loops; none is printed, nor are the box, the"
        " population or the seed of the search. Units of beta and Ke assumed",
    )


@functools.cache
def _searches() -> dict[str, SearchRun]:
    loops = identification_loops()
    runs = compare_searches(
        lambda values: maxwell_residual(values, loops),
        [c.low for c in MAXWELL],
        [c.high for c in MAXWELL],
        tolerance=1e-3,
        iterations=100,
    )
    return {run.method: run for run in runs}


def _recovered(id: str, method: str) -> Claim:
    run, told = _searches()[method], element()
    found = (run.x[0], 10.0 ** run.x[1], 10.0 ** run.x[2])
    return compare(
        id,
        f"minimising (16) finds alpha, beta and Ke, here by {method.replace('_', ' ')}",
        told,
        found,
        [_SHARE * abs(number) for number in told],
        unit="1, s, N/m",
        reason=f"{_GENERATED}; left a cost of {run.value:.3g} N^2 after {run.evaluations}"
        f" evaluations; beta and Ke searched by their logarithms in {10.0 ** MAXWELL[1].low:g} to"
        f" {10.0 ** MAXWELL[1].high:g} s and {10.0 ** MAXWELL[2].low:g} to"
        f" {10.0 ** MAXWELL[2].high:g} N/m. The cost has a second minimum at"
        " short beta; recovered means within 1 %",
    )


def _converged() -> Claim:
    loops, count = identification_loops(), int(value("converged_after"))

    def cost(values: FloatArray) -> float:
        exponents = np.array([values[0], math.log10(values[1]), math.log10(values[2])])
        miss = maxwell_residual(exponents, loops)
        return float(miss @ miss)

    low, high = zip(*_BOX, strict=True)
    ends = [
        water_cycle(
            cost, low, high, rng=np.random.default_rng(seed), iterations=count, shrinking=True
        ).value
        for seed in _SEEDS
    ]
    middle = float(np.median(ends))
    return Claim(
        id="C-31",
        what="the cost has converged to zero after 20 iterations of the water cycle algorithm",
        printed=0.0,
        recomputed=middle,
        unit="N^2",
        verdict=holds(middle <= 1.0, Verdict.NOT_REPRODUCIBLE),
        reason=f"median of {len(ends)} seeds, 50 raindrops, Table 1's shrinking C; {_GENERATED};"
        " the element fits them exactly. Measured loops that show errors, as Figures 11 and 12 do,"
        " cannot bring a sum of squares to zero; the axis of Figure 10 is not printed",
        tolerance=1.0,
    )


def _digits() -> Claim:
    loops, told = identification_loops(), np.array(element())

    def residual(logs: FloatArray) -> FloatArray:
        alpha, beta, stiffness = told * np.exp(logs)
        return maxwell_residual(np.array([alpha, math.log10(beta), math.log10(stiffness)]), loops)

    step = 1e-6
    columns = [(residual(step * e) - residual(-step * e)) / (2.0 * step) for e in np.eye(3)]
    inverse = np.linalg.pinv(np.stack(columns, axis=1))
    # The cost is linear in the measured x1, x2: Ke (w beta)^alpha each.
    gain = np.repeat([(loop.frequency * told[1]) ** told[0] * told[2] for loop in loops], 2)
    size = np.array([abs(x) for loop in loops for x in (loop.at_force, loop.at_zero)])
    spread = np.sqrt(np.sum((inverse * (gain * _NOISE * size)) ** 2, axis=1))
    half = 1.96 * spread
    numbers = [printed_number("C", name) for name in ("order", "time_constant", "stiffness")]
    digits = tuple(number.half_unit / number.value for number in numbers)
    return Claim(
        id="C-32",
        what="alpha, beta and Ke are known to the printed digits: half 95 % intervals, relative, of"
        " loops measured within 1 %",
        printed=digits,
        recomputed=tuple(float(number) for number in half),
        unit="1",
        verdict=holds(bool(np.all(half <= digits)), Verdict.NOT_REPRODUCIBLE),
        reason="linearised, independent errors of 1 % (one standard deviation) in x1 and x2 of the"
        " ten loops; the printed column is half a unit of the last digit. alpha, beta and Ke trade"
        " off against each other along a valley: four digits of beta mean nothing",
    )


def _shares() -> Claim:
    rivers, population = 3, 50
    rng = np.random.default_rng(0)
    fitness = np.sort(rng.uniform(1.0, 100.0, population))
    lead = np.abs(fitness[: rivers + 1] - fitness[rivers + 1])
    streams = population - (rivers + 1)
    printed = float(np.sum(np.round(lead / np.sum(fitness[: rivers + 1]) * streams)))
    mended = float(np.sum(np.round(lead / np.sum(lead) * streams)))
    return Claim(
        id="C-33",
        what="Table 1, step 4: the shares of sea and rivers add up to all streams",
        printed=float(streams),
        recomputed=printed,
        unit="1",
        verdict=holds(abs(printed - streams) <= rivers + 1, Verdict.INCONSISTENT),
        reason="differences of costs over a sum of costs; shares taken over the sum of the same"
        f" differences add up to {mended:.0f}. Random costs of {population} raindrops, sorted;"
        " a unit of rounding allowed for each of the four",
        tolerance=float(rivers + 1),
    )
