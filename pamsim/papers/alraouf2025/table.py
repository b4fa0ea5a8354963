"""Alraouf 2025, Table 2: its intervals, its loop, and the sentences on what it shows."""

from __future__ import annotations

import math

import numpy as np
from scipy.special import stdtrit

from pamsim.core.units import FloatArray
from pamsim.papers.alraouf2025.loop import (
    SCORES,
    arctangent_residual,
    branch_data,
    differences,
    loop_scores,
    published,
)
from pamsim.papers.claim import Recomputed, recomputes
from pamsim.papers.numerics import half_unit, propagated
from pamsim.recordings.printed import (
    BRANCHES,
    LoopRow,
    Printed,
    arctangent_law,
    loop_equation,
    loop_rows,
    printed_document,
)

_RUNS = 3
# The table drops trailing zeros (30.05 beside 30.053): all its numbers have three decimals.
_ROUNDING = half_unit(3)


def _ranger() -> Printed:
    """Printed accuracy of the distance sensor [cm]."""
    document = printed_document("alraouf2025.toml", digits=True)
    return Printed(0.1 * document["ranger"]["accuracy"]["value"], half_unit(1))


@recomputes("alraouf2025-41", "up")
@recomputes("alraouf2025-42", "down")
def _intervals(branch: str) -> Recomputed:
    student = float(stdtrit(_RUNS - 1, 0.975))
    factor = student / math.sqrt(_RUNS)

    def off(row: LoopRow) -> float:
        return abs(row.half_interval.value - factor * row.deviation.value)

    worst = max(loop_rows(branch), key=off)
    return Recomputed(
        Printed(off(worst), _ROUNDING * (1.0 + factor)),
        low=0.0,
        high=0.0,
        student=student,
        pressure=worst.pressure_kpa,
        printed_half=worst.half_interval.value,
        half=factor * worst.deviation.value,
    )


@recomputes("alraouf2025-43", "up")
@recomputes("alraouf2025-44", "down")
def _residual_size(branch: str) -> Recomputed:
    residual = np.abs(arctangent_residual(branch, published(branch)))
    limit = Printed(0.3, half_unit(1))
    largest = limit.value + limit.half_unit
    return Recomputed(
        propagated(
            lambda *a: float(np.max(np.abs(arctangent_residual(branch, a)))), *loop_equation(branch)
        ),
        high=limit,
        pressure=branch_data(branch)[0][int(residual.argmax())],
        limit=largest,
        beyond=int(np.sum(residual > largest)),
        rows=len(residual),
    )


@recomputes("alraouf2025-45", "up")
@recomputes("alraouf2025-46", "down")
def _residual_order(branch: str) -> Recomputed:
    residual = -arctangent_residual(branch, published(branch))
    centred = residual - residual.mean()
    lag = float(centred[1:] @ centred[:-1] / (centred @ centred))
    limit = 1.96 / math.sqrt(len(residual))
    return Recomputed(lag, low=0.0, high=0.0, scatter=limit, mean=residual.mean(), limit=limit)


def _differences() -> tuple[FloatArray, FloatArray]:
    difference, half = zip(*differences(), strict=True)
    return np.array([number.value for number in difference]), np.array(half)


@recomputes("alraouf2025-47")
def _clear_difference() -> Recomputed:
    difference, half = _differences()
    of_mean = float(np.sqrt(np.sum(half**2))) / len(half)
    return Recomputed(
        float(difference.mean()),
        low=0.0,
        scatter=of_mean,
        half=of_mean,
        clear=int(np.sum(np.abs(difference) > half)),
        pressures=len(difference),
        largest=np.abs(difference).max(),
        ranger=_ranger().value,
    )


@recomputes("alraouf2025-48")
def _delayed() -> Recomputed:
    difference, half = _differences()
    pressure, _ = branch_data("up")
    rising, falling = (arctangent_law(pressure, *published(branch)) for branch in BRANCHES)
    against = [f"{p:.0f}" for p, gap in zip(pressure, difference, strict=True) if gap < 0.0]
    return Recomputed(
        difference.tolist(),
        low=0.0,
        scatter=half.tolist(),
        against=", ".join(against),
        right=int(np.sum(rising > falling)),
        pressures=len(difference),
    )


@recomputes("alraouf2025-49", 0)
@recomputes("alraouf2025-50", 9)
def _still(index: int) -> Recomputed:
    ends = [loop_rows(branch)[index : index + 2] for branch in BRANCHES]
    change = [second.mean.value - first.mean.value for first, second in ends]
    half = [math.hypot(a.half_interval.value, b.half_interval.value) for a, b in ends]
    least = Printed(-_ranger().value, _ranger().half_unit)
    return Recomputed(change, low=least, high=_ranger(), scatter=half, up=half[0], down=half[1])


@recomputes("alraouf2025-51")
def _low_deviations() -> Recomputed:
    rows = [row for branch in BRANCHES for row in loop_rows(branch)]
    worst = max(rows, key=lambda row: row.deviation.value)
    stroke = max(r.mean.value for r in rows) - min(r.mean.value for r in rows)
    return Recomputed(
        (worst.deviation, worst.half_interval),
        high=_ranger(),
        pressure=worst.pressure_kpa,
        branch=worst.branch,
        share=100.0 * worst.half_interval.value / stroke,
        stroke=stroke,
        exceeding=sum(r.half_interval.value > _ranger().value for r in rows),
        rows=len(rows),
    )


@recomputes("alraouf2025-52")
def _rest_length() -> Recomputed:
    return Recomputed([loop_rows(branch)[0].mean for branch in BRANCHES])


@recomputes("alraouf2025-53")
def _stage_of_table_4() -> Recomputed:
    printed = printed_document("alraouf2025.toml", digits=True)["text_scores"]
    table = loop_scores("down", "arctangent")
    return Recomputed([table[score] for score in SCORES], printed=printed["up"])
