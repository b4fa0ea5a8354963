"""Alraouf 2025, Table 2: its intervals, its loop, and the sentences on what it shows."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from pamsim.papers.alraouf2025.arctangent import published
from pamsim.papers.claim import Claim, Verdict, compare, half_unit, holds
from pamsim.papers.loop_fits import branch_data
from pamsim.signals.static_law import arctangent_law
from pamsim.store.printed_loop import BRANCHES, LoopRow, loop_rows

FloatArray = NDArray[np.float64]

_RUNS = 3
_RANGER = 0.3  # cm, printed accuracy of the distance sensor
_LENGTH = 30.0  # cm, printed length of the muscle
# The table drops trailing zeros (30.05 beside 30.053): all its numbers have three decimals.
_ROUNDING = half_unit(3)


def claims() -> list[Claim]:
    """Claims B-41 to B-53."""
    found = [_intervals(f"B-{41 + i}", branch) for i, branch in enumerate(BRANCHES)]
    found += [_residual_size(f"B-{43 + i}", branch) for i, branch in enumerate(BRANCHES)]
    found += [_residual_order(f"B-{45 + i}", branch) for i, branch in enumerate(BRANCHES)]
    return [
        *found,
        _clear_difference(),
        _delayed(),
        _still(0, "B-49", "between 0 and 50 kPa"),
        _still(9, "B-50", "between 450 and 500 kPa"),
        _low_deviations(),
        _rest_length(),
        _wrong_labels(),
    ]


def _student() -> float:
    return float(stdtrit(_RUNS - 1, 0.975))


def _intervals(id: str, branch: str) -> Claim:
    factor = _student() / math.sqrt(_RUNS)

    def off(row: LoopRow) -> float:
        return abs(row.half_interval.value - factor * row.deviation.value)

    rows = loop_rows(branch)
    worst = max(rows, key=off)
    tolerance = _ROUNDING * (1.0 + factor)
    return compare(
        id,
        f"Table 2, {branch}: CI is t SD / sqrt(3), three runs; largest deviation",
        0.0,
        off(worst),
        tolerance,
        unit="cm",
        reason=f"Student's t with 2 degrees of freedom, {_student():.4f}; worst row"
        f" {worst.pressure_kpa:.0f} kPa, printed {worst.half_interval.value:g}, recomputed"
        f" {factor * worst.deviation.value:.4f}; tolerance: rounding of CI and of SD times"
        f" {factor:.3f}",
        otherwise=Verdict.INCONSISTENT,
    )


def _residual(branch: str) -> FloatArray:
    pressure, length = branch_data(branch)
    return length - arctangent_law(pressure, *published(branch))


def _residual_size(id: str, branch: str) -> Claim:
    residual = np.abs(_residual(branch))
    pressure, _ = branch_data(branch)
    return Claim(
        id=id,
        what=f"residuals of the printed arctangent stay within +-0.3 cm, {branch}; largest",
        printed=0.3,
        recomputed=float(residual.max()),
        unit="cm",
        verdict=holds(float(residual.max()) <= 0.3 + half_unit(1), Verdict.NOT_REPRODUCIBLE),
        reason=f"on Table 2's means, largest at {pressure[int(residual.argmax())]:.0f} kPa;"
        f" {int(np.sum(residual > 0.3 + half_unit(1)))} of {len(residual)} are beyond 0.35 cm."
        " Figure 7 shows other residuals, since other lengths were fitted",
        tolerance=half_unit(1),
    )


def _residual_order(id: str, branch: str) -> Claim:
    residual = _residual(branch)
    centred = residual - residual.mean()
    lag = float(centred[1:] @ centred[:-1] / (centred @ centred))
    limit = 1.96 / math.sqrt(len(residual))
    return compare(
        id,
        f"residuals are random without systematic bias, {branch}: correlation of neighbours",
        0.0,
        lag,
        limit,
        unit="1",
        reason=f"lag-one autocorrelation of the 11 residuals on Table 2's means, mean"
        f" {residual.mean():+.3f} cm; tolerance: 95 % limit of white residuals, {limit:.2f}, which"
        " 11 points pass easily",
    )


def _differences() -> tuple[FloatArray, FloatArray]:
    """Up minus down length at each pressure, and its standard error [cm]."""
    up, down = loop_rows("up"), loop_rows("down")
    difference = [a.mean.value - b.mean.value for a, b in zip(up, down, strict=True)]
    error = [
        math.hypot(a.deviation.value, b.deviation.value) / math.sqrt(_RUNS)
        for a, b in zip(up, down, strict=True)
    ]
    return np.array(difference), np.array(error)


def _clear_difference() -> Claim:
    difference, error = _differences()
    up, down = loop_rows("up"), loop_rows("down")
    clear = 0
    for gap, spread, a, b in zip(difference, error, up, down, strict=True):
        parts = [row.deviation.value**2 / _RUNS for row in (a, b)]
        freedom = sum(parts) ** 2 / sum(part**2 / (_RUNS - 1) for part in parts)
        clear += abs(gap) > float(stdtrit(freedom, 0.975)) * spread
    mean = float(difference.mean())
    half = 2.0 * float(np.sqrt(np.sum(error**2))) / len(error)
    return Claim(
        id="B-47",
        what="clear difference between rising and falling pressure; pressures where it is",
        printed="a clear difference",
        recomputed=float(clear),
        unit="1",
        verdict=holds(clear > len(difference) // 2, Verdict.NOT_REPRODUCIBLE),
        reason=f"Welch's t at 95 % from the printed means and SD of three runs, at"
        f" {len(difference)} pressures. Largest difference {np.abs(difference).max():.3f} cm, mean"
        f" {mean:.3f} +- {half:.3f} cm (k = 2); the sensor's accuracy is {_RANGER:g} cm. Reproduced"
        " would mean at more than half of the pressures",
    )


def _delayed() -> Claim:
    difference, _ = _differences()
    pressure, _ = branch_data("up")
    rising, falling = (arctangent_law(pressure, *published(branch)) for branch in BRANCHES)
    right = int(np.sum(rising > falling))
    against = [f"{p:.0f}" for p, gap in zip(pressure, difference, strict=True) if gap < 0.0]
    return Claim(
        id="B-48",
        what="hysteresis: at equal pressure the muscle is shorter while it is vented; pressures",
        printed=float(len(difference)),
        recomputed=float(len(difference) - len(against)),
        unit="1",
        verdict=holds(not against, Verdict.INCONSISTENT),
        reason=f"means of Table 2; the order is opposite at {', '.join(against)} kPa. The printed"
        f" curves (3) and (4) have it right at {right} of the {len(difference)} pressures",
        tolerance=0.0,
    )


def _still(index: int, id: str, where: str) -> Claim:
    changes: list[float] = []
    for branch in BRANCHES:
        _, length = branch_data(branch)
        changes.append(float(length[index + 1] - length[index]))
    return compare(
        id,
        f"the length is constant {where}: change, up and down",
        (0.0, 0.0),
        changes,
        _RANGER,
        unit="cm",
        reason="means of Table 2; tolerance: the distance sensor's printed accuracy of 3 mm",
        otherwise=Verdict.INCONSISTENT,
    )


def _low_deviations() -> Claim:
    rows = [row for branch in BRANCHES for row in loop_rows(branch)]
    worst = max(rows, key=lambda row: row.deviation.value)
    stroke = max(r.mean.value for r in rows) - min(r.mean.value for r in rows)
    return Claim(
        id="B-51",
        what="the set-up is accurate, as low SD and CI show; largest SD and CI",
        printed="low",
        recomputed=(worst.deviation.value, worst.half_interval.value),
        unit="cm",
        verdict=holds(worst.half_interval.value <= _RANGER, Verdict.INCONSISTENT),
        reason=f"at {worst.pressure_kpa:.0f} kPa, {worst.branch}: CI is"
        f" {100.0 * worst.half_interval.value / stroke:.0f} % of the whole stroke of {stroke:.2f}"
        f" cm; {sum(r.half_interval.value > _RANGER for r in rows)} of {len(rows)} CI exceed the"
        " sensor's accuracy, which counted as low",
        tolerance=_RANGER,
    )


def _rest_length() -> Claim:
    lengths = [float(branch_data(branch)[1][0]) for branch in BRANCHES]
    return compare(
        "B-52",
        "the muscle is 30 cm long without pressure: before and after the loop",
        (_LENGTH, _LENGTH),
        lengths,
        _RANGER,
        unit="cm",
        reason="means of Table 2 at 0 kPa; the program was set to read 30 cm there; tolerance: the"
        " distance sensor's printed accuracy",
        otherwise=Verdict.INCONSISTENT,
    )


def _wrong_labels() -> Claim:
    return Claim(
        id="B-53",
        what="Table 1 holds the standard deviations; Table 4 is of the increase stage",
        printed="Table 1; increase stage",
        recomputed="Table 2; descending stage",
        unit="",
        verdict=Verdict.INCONSISTENT,
        reason="Table 1 holds coefficients and their intervals; the numbers of Table 4 are those"
        " the text gives for the descending stage, as its caption says",
    )
