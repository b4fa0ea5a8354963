"""Section 3: whether the cost (16) and the water cycle algorithm determine the element."""

from __future__ import annotations

import functools
import math

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.fitting.maxwell import MAXWELL, LoopPoints, maxwell_loop, maxwell_residual
from pamsim.fitting.search_comparison import SearchRun, compare_searches
from pamsim.fitting.water_cycle import water_cycle
from pamsim.papers.claim import Recomputed, recomputes
from pamsim.papers.nguyen2024.geometry import (
    element,
    omega,
    printed_element,
    value,
    values,
)
from pamsim.papers.numerics import half_unit, propagated
from pamsim.recordings.printed import Printed

_BOX = ((0.01, 0.99), (1.0, 200.0), (1e2, 1e4))
"""Of alpha [-], beta [s], Ke [N/m], round the printed numbers; the paper prints no box."""
_SEEDS = range(5)
_NOISE = 0.01


@functools.cache
def _loops() -> tuple[LoopPoints, ...]:
    """What the ten test loops would be if the identified element were the muscle."""
    return tuple(
        maxwell_loop(*element(), omega(f), value("test_amplitude"))
        for f in values("test_frequencies")
    )


@functools.cache
def _searches() -> dict[str, SearchRun]:
    runs = compare_searches(
        lambda place: maxwell_residual(place, _loops()),
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
    limits = {
        f"{name}_{end}": 10.0 ** getattr(coordinate, end)
        for name, coordinate in zip(("beta", "stiffness"), MAXWELL[1:], strict=True)
        for end in ("low", "high")
    }
    result = (run.x[0], 10.0 ** run.x[1], 10.0 ** run.x[2])
    return Recomputed(result, cost=run.value, evaluations=run.evaluations, **limits)


def _residual(element: FloatArray) -> FloatArray:
    """Residual of the cost (16) at alpha [-], beta [s], Ke [N/m]."""
    alpha, beta, stiffness = element
    return maxwell_residual(np.array([alpha, math.log10(beta), math.log10(stiffness)]), _loops())


@recomputes("nguyen2024-31")
def _converged() -> Recomputed:
    count = int(value("converged_after"))

    def cost(place: FloatArray) -> float:
        miss = _residual(place)
        return float(miss @ miss)

    low, high = zip(*_BOX, strict=True)
    runs = [
        water_cycle(
            cost, low, high, rng=np.random.default_rng(seed), iterations=count, shrinking=True
        )
        for seed in _SEEDS
    ]
    runs.sort(key=lambda run: run.value)
    rounded = propagated(lambda *place: cost(np.array(place)), *printed_element())
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
    loops, (alpha, beta, stiffness), step = _loops(), element(), 1e-6

    def residual(logs: FloatArray) -> FloatArray:
        return _residual(np.array([alpha, beta, stiffness]) * np.exp(logs))

    columns = [(residual(step * e) - residual(-step * e)) / (2.0 * step) for e in np.eye(3)]
    inverse = np.linalg.pinv(np.stack(columns, axis=1))
    # The cost is linear in the measured x1, x2: Ke (w beta)^alpha each.
    gain = np.repeat([(loop.frequency * beta) ** alpha * stiffness for loop in loops], 2)
    size = np.array([abs(x) for loop in loops for x in (loop.at_force, loop.at_zero)])
    half = 1.96 * np.sqrt(np.sum((inverse * (gain * _NOISE * size)) ** 2, axis=1))
    digits = tuple(number.half_unit / number.value for number in printed_element())
    return Recomputed(tuple(half.tolist()), printed=digits, high=digits)


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
