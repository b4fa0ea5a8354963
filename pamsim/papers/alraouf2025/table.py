"""Alraouf 2025, Table 2: its intervals, its loop, and the sentences on what it shows."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from pamsim.papers.alraouf2025.loop import branch_data, published
from pamsim.papers.claim import Recomputed, half_unit, recomputes
from pamsim.signals.static_law import arctangent_law
from pamsim.store.printed import BRANCHES, LoopRow, loop_rows

FloatArray = NDArray[np.float64]

_RUNS = 3
_RANGER = 0.3  # cm, printed accuracy of the distance sensor
# The table drops trailing zeros (30.05 beside 30.053): all its numbers have three decimals.
_ROUNDING = half_unit(3)


def _student() -> float:
    return float(stdtrit(_RUNS - 1, 0.975))


@recomputes("alraouf2025-41", "up")
@recomputes("alraouf2025-42", "down")
def _intervals(branch: str) -> Recomputed:
    factor = _student() / math.sqrt(_RUNS)

    def off(row: LoopRow) -> float:
        return abs(row.half_interval.value - factor * row.deviation.value)

    rows = loop_rows(branch)
    worst = max(rows, key=off)
    tolerance = _ROUNDING * (1.0 + factor)
    return Recomputed(
        off(worst),
        tolerance=tolerance,
        student=_student(),
        pressure=worst.pressure_kpa,
        printed_half=worst.half_interval.value,
        half=factor * worst.deviation.value,
        factor=factor,
    )


def _residual(branch: str) -> FloatArray:
    pressure, length = branch_data(branch)
    return length - arctangent_law(pressure, *published(branch))


@recomputes("alraouf2025-43", "up")
@recomputes("alraouf2025-44", "down")
def _residual_size(branch: str) -> Recomputed:
    residual = np.abs(_residual(branch))
    pressure, _ = branch_data(branch)
    return Recomputed(
        float(residual.max()),
        holds=float(residual.max()) <= 0.3 + half_unit(1),
        pressure=pressure[int(residual.argmax())],
        beyond=int(np.sum(residual > 0.3 + half_unit(1))),
        rows=len(residual),
    )


@recomputes("alraouf2025-45", "up")
@recomputes("alraouf2025-46", "down")
def _residual_order(branch: str) -> Recomputed:
    residual = _residual(branch)
    centred = residual - residual.mean()
    lag = float(centred[1:] @ centred[:-1] / (centred @ centred))
    limit = 1.96 / math.sqrt(len(residual))
    return Recomputed(lag, tolerance=limit, mean=residual.mean(), limit=limit)


def _differences() -> tuple[FloatArray, FloatArray]:
    """Up minus down length at each pressure, and its standard error [cm]."""
    up, down = loop_rows("up"), loop_rows("down")
    difference = [a.mean.value - b.mean.value for a, b in zip(up, down, strict=True)]
    error = [
        math.hypot(a.deviation.value, b.deviation.value) / math.sqrt(_RUNS)
        for a, b in zip(up, down, strict=True)
    ]
    return np.array(difference), np.array(error)


@recomputes("alraouf2025-47")
def _clear_difference() -> Recomputed:
    difference, error = _differences()
    up, down = loop_rows("up"), loop_rows("down")
    clear = 0
    for gap, spread, a, b in zip(difference, error, up, down, strict=True):
        parts = [row.deviation.value**2 / _RUNS for row in (a, b)]
        freedom = sum(parts) ** 2 / sum(part**2 / (_RUNS - 1) for part in parts)
        clear += abs(gap) > float(stdtrit(freedom, 0.975)) * spread
    mean = float(difference.mean())
    half = 2.0 * float(np.sqrt(np.sum(error**2))) / len(error)
    return Recomputed(
        float(clear),
        holds=clear > len(difference) // 2,
        pressures=len(difference),
        largest=np.abs(difference).max(),
        mean=mean,
        half=half,
        ranger=_RANGER,
    )


@recomputes("alraouf2025-48")
def _delayed() -> Recomputed:
    difference, _ = _differences()
    pressure, _ = branch_data("up")
    rising, falling = (arctangent_law(pressure, *published(branch)) for branch in BRANCHES)
    right = int(np.sum(rising > falling))
    against = [f"{p:.0f}" for p, gap in zip(pressure, difference, strict=True) if gap < 0.0]
    return Recomputed(
        float(len(difference) - len(against)),
        against=", ".join(against),
        right=right,
        pressures=len(difference),
    )


@recomputes("alraouf2025-49", 0)
@recomputes("alraouf2025-50", 9)
def _still(index: int) -> Recomputed:
    changes: list[float] = []
    for branch in BRANCHES:
        _, length = branch_data(branch)
        changes.append(float(length[index + 1] - length[index]))
    return Recomputed(changes)


@recomputes("alraouf2025-51")
def _low_deviations() -> Recomputed:
    rows = [row for branch in BRANCHES for row in loop_rows(branch)]
    worst = max(rows, key=lambda row: row.deviation.value)
    stroke = max(r.mean.value for r in rows) - min(r.mean.value for r in rows)
    return Recomputed(
        (worst.deviation.value, worst.half_interval.value),
        holds=worst.half_interval.value <= _RANGER,
        pressure=worst.pressure_kpa,
        branch=worst.branch,
        share=100.0 * worst.half_interval.value / stroke,
        stroke=stroke,
        exceeding=sum(r.half_interval.value > _RANGER for r in rows),
        rows=len(rows),
    )


@recomputes("alraouf2025-52")
def _rest_length() -> Recomputed:
    lengths = [float(branch_data(branch)[1][0]) for branch in BRANCHES]
    return Recomputed(lengths)
