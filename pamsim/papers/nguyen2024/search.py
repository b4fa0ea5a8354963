"""Section 3: whether the cost (16) and the water cycle algorithm determine the element."""

from __future__ import annotations

import functools
import math

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.fitting.maxwell import MAXWELL, maxwell_residual
from pamsim.fitting.search_comparison import SearchRun, compare_searches
from pamsim.fitting.water_cycle import water_cycle
from pamsim.papers.claim import Recomputed, recomputes
from pamsim.papers.nguyen2024.numbers import (
    element,
    identification_loops,
    printed_element,
    value,
)
from pamsim.papers.rounding import half_unit, propagated
from pamsim.recordings.printed import Printed

_BOX = ((0.01, 0.99), (1.0, 200.0), (1e2, 1e4))
"""Of alpha [-], beta [s], Ke [N/m], round the printed numbers; the paper prints no box."""
_SEEDS = range(5)
_NOISE = 0.01


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


@recomputes("nguyen2024-28", "least_squares")
@recomputes("nguyen2024-29", "differential_evolution")
@recomputes("nguyen2024-30", "water_cycle")
def _recovered(method: str) -> Recomputed:
    run = _searches()[method]
    result = (run.x[0], 10.0 ** run.x[1], 10.0 ** run.x[2])
    return Recomputed(
        result,
        cost=run.value,
        evaluations=run.evaluations,
        beta_low=10.0 ** MAXWELL[1].low,
        beta_high=10.0 ** MAXWELL[1].high,
        stiffness_low=10.0 ** MAXWELL[2].low,
        stiffness_high=10.0 ** MAXWELL[2].high,
    )


@recomputes("nguyen2024-31")
def _converged() -> Recomputed:
    loops, count = identification_loops(), int(value("converged_after"))

    def cost(values: FloatArray) -> float:
        exponents = np.array([values[0], math.log10(values[1]), math.log10(values[2])])
        miss = maxwell_residual(exponents, loops)
        return float(miss @ miss)

    low, high = zip(*_BOX, strict=True)
    runs = [
        water_cycle(
            cost, low, high, rng=np.random.default_rng(seed), iterations=count, shrinking=True
        )
        for seed in _SEEDS
    ]
    runs.sort(key=lambda run: run.value)
    rounded = propagated(lambda *values: cost(np.array(values)), *printed_element())
    return Recomputed(
        runs[len(runs) // 2].x.tolist(),
        seeds=len(runs),
        least=runs[0].value,
        most=runs[-1].value,
        least_order=min(run.x[0] for run in runs),
        most_order=max(run.x[0] for run in runs),
        rounding=rounded.half_unit,
    )


@recomputes("nguyen2024-32")
def _digits() -> Recomputed:
    loops, identified = identification_loops(), np.array(element())

    def residual(logs: FloatArray) -> FloatArray:
        alpha, beta, stiffness = identified * np.exp(logs)
        return maxwell_residual(np.array([alpha, math.log10(beta), math.log10(stiffness)]), loops)

    step = 1e-6
    columns = [(residual(step * e) - residual(-step * e)) / (2.0 * step) for e in np.eye(3)]
    inverse = np.linalg.pinv(np.stack(columns, axis=1))
    # The cost is linear in the measured x1, x2: Ke (w beta)^alpha each.
    alpha, beta, stiffness = element()
    gain = np.repeat([(loop.frequency * beta) ** alpha * stiffness for loop in loops], 2)
    size = np.array([abs(x) for loop in loops for x in (loop.at_force, loop.at_zero)])
    spread = np.sqrt(np.sum((inverse * (gain * _NOISE * size)) ** 2, axis=1))
    half = 1.96 * spread
    digits = tuple(number.half_unit / number.value for number in printed_element())
    return Recomputed(tuple(float(number) for number in half), printed=digits, high=digits)


@recomputes("nguyen2024-33")
def _shares() -> Recomputed:
    rivers, population = 3, 50
    rng = np.random.default_rng(0)
    fitness = np.sort(rng.uniform(1.0, 100.0, population))
    lead = np.abs(fitness[: rivers + 1] - fitness[rivers + 1])
    streams = population - (rivers + 1)
    printed = float(np.sum(np.round(lead / np.sum(fitness[: rivers + 1]) * streams)))
    mended = float(np.sum(np.round(lead / np.sum(lead) * streams)))
    return Recomputed(
        Printed(printed, half_unit(0) * (rivers + 1)),  # every share is rounded
        printed=Printed(float(streams), 0.0),
        mended=mended,
        population=population,
    )
