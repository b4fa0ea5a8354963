"""Matiskova 2021, Tables 1 and 2: their arithmetic, and the static law (17), (23) against them."""

from __future__ import annotations

import itertools
import math
from statistics import median_high
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from pamsim.core.units import DEG_PER_RAD, PA_PER_BAR, PA_PER_KPA, FloatArray
from pamsim.papers.claim import Order, Recomputed, recomputes
from pamsim.papers.numerics import PrintedNumbers, half_unit, propagated, rms
from pamsim.papers.torque_law import printed_rows_law
from pamsim.recordings.printed import (
    Printed,
    distinct_steps,
    mas20_models,
    mas20_steps,
    printed_table,
)

_CURVE_POINTS = 301
_LAW = [PrintedNumbers("matiskova2021", "static").digits(f"a{i}_deg") for i in range(3)]
_FIGURES = ("p1_kpa", "p2_kpa", "p_svd_kpa", "load_kg", "beta_increment", "beta_deg")
# The tables print 183.3 and 253 beside each other: counts are meant to one decimal in Table 1.
_COUNT_HALF_UNIT = {"1": half_unit(1), "2": half_unit(2)}


def _rows() -> list[dict[str, str]]:
    return printed_table("matiskova2021_steps.csv")


def _increment_deg() -> float:
    return 360.0 / float(mas20_models()["encoder"]["increments_per_revolution"])


def _counted_deg(row: dict[str, str]) -> Printed:
    """Size of the counted angle [deg]."""
    size = abs(float(row["beta_increment"]))
    return Printed(size * _increment_deg(), _COUNT_HALF_UNIT[row["table"]] * _increment_deg())


def _printed_deg(row: dict[str, str]) -> Printed:
    """Size of the printed angle [deg]."""
    return Printed.read(row["beta_deg"].lstrip("-"))


@recomputes("matiskova2021-01")
def _differences() -> Recomputed:
    rows = _rows()
    off = [float(r["p1_kpa"]) - float(r["p2_kpa"]) - float(r["p_svd_kpa"]) for r in rows]
    return Recomputed(max(map(abs, off)), rows=len(rows))


@recomputes("matiskova2021-02")
def _increment() -> Recomputed:
    rows = _rows()
    ratios = [abs(float(r["beta_deg"]) / float(r["beta_increment"])) for r in rows]
    middle = rows[ratios.index(median_high(ratios))]
    spread = (max(ratios) - min(ratios)) / median_high(ratios)
    count = Printed(abs(float(middle["beta_increment"])), _COUNT_HALF_UNIT[middle["table"]])
    result = propagated(lambda angle, n: 360.0 * n / angle, _printed_deg(middle), count)
    return Recomputed(result, median=median_high(ratios), spread=100.0 * spread)


@recomputes("matiskova2021-03", each=("1", "2"))
def _degrees(table: str) -> Recomputed:
    rows = [row for row in _rows() if row["table"] == table]
    excess = [_counted_deg(row).value - _printed_deg(row).value for row in rows]
    slack = half_unit(2) + _COUNT_HALF_UNIT[table] * _increment_deg()
    cut = sum(-slack <= off - half_unit(2) <= slack for off in excess)
    return Recomputed(
        [_counted_deg(row) for row in rows],
        printed=[_printed_deg(row) for row in rows],
        rows=len(rows),
        worst=rows[excess.index(max(excess, key=abs))]["row"],
        excess=max(excess, key=abs),
        rounded=sum(abs(off) <= slack for off in excess),
        cut=cut,
    )


@recomputes("matiskova2021-05")
def _whole_counts() -> Recomputed:
    counts = [float(row["beta_increment"]) for row in _rows()]
    # Four-fold evaluation of both encoder tracks could give quarters, nothing finer.
    broken = [c for c in counts if abs(4.0 * c - round(4.0 * c)) > 4.0 * half_unit(2)]
    return Recomputed(
        float(len(counts) - len(broken)),
        broken=len(broken),
        counts=len(counts),
        examples=", ".join(f"{c:g}" for c in broken[:4]),
    )


@recomputes("matiskova2021-06")
def _row_4() -> Printed:
    row = next(row for row in _rows() if row["row"] == "4")
    return propagated(lambda angle: angle / _increment_deg(), Printed.read(row["beta_deg"]))


@recomputes("matiskova2021-07")
def _repeats() -> Recomputed:
    rows = _rows()
    figures = [tuple(Printed.read(row[name]).value for name in _FIGURES) for row in rows]
    copies = [row["row"] for i, row in enumerate(rows) if figures[i] in figures[:i]]
    distinct = len(rows) - len(copies)
    return Recomputed(float(distinct), copies=", ".join(copies))


@recomputes("matiskova2021-08")
def _signs() -> float:
    steps = mas20_steps()
    return float(sum(step.angle * (step.pressure[0] - step.pressure[1]) > 0.0 for step in steps))


def odd_exponential_basis(x: FloatArray) -> FloatArray:
    """Factors (n, 3) of a0, a1, a2 in (17), continued as an odd function (Matiskova 2021, (22)).

    Taken at pressure differences (n,) over the pressure that counts as 1 [-].
    """
    size = np.abs(x)
    decay = np.exp(-size)
    return np.sign(x)[:, np.newaxis] * np.stack([np.ones_like(size), decay, size * decay], axis=1)


def static_angle(pressure_difference: FloatArray, scale: float) -> FloatArray:
    """Equation (23) of Matiskova 2021 [deg], continued as an odd function.

    It is taken at p1 - p2 (n,) [Pa], with the scale [Pa] as the pressure that counts as 1.
    """
    coefficients = [number.value for number in _LAW]
    return odd_exponential_basis(pressure_difference / scale) @ coefficients


def _data() -> tuple[FloatArray, FloatArray]:
    """Pressure difference [Pa] and angle [deg] of the distinct rows."""
    steps = distinct_steps()
    difference = np.array([step.pressure[0] - step.pressure[1] for step in steps])
    return difference, np.array([step.angle for step in steps]) * DEG_PER_RAD


def static_characteristic() -> dict[str, Any]:
    """Equation (23) against the printed tables, read in bar and with the scale that fits best."""
    difference, measured = _data()

    def misfit(scale: float) -> float:
        return rms(static_angle(difference, scale) - measured)

    best = minimize_scalar(misfit, bounds=(0.5 * PA_PER_BAR, 5.0 * PA_PER_BAR), method="bounded")
    curve = np.linspace(-500.0, 500.0, _CURVE_POINTS) * PA_PER_KPA
    return {
        "p_svd_kpa": (curve / PA_PER_KPA).tolist(),
        "eq23_bar_deg": static_angle(curve, PA_PER_BAR).tolist(),
        "eq23_scaled_deg": static_angle(curve, float(best.x)).tolist(),
        "scale_kpa": float(best.x) / PA_PER_KPA,
        "rms_bar_deg": misfit(PA_PER_BAR),
        "rms_scaled_deg": float(best.fun),
    }


def _fit(scale: float) -> tuple[tuple[float, ...], float]:
    """Least squares of (17), continued as an odd function: coefficients and RMS [deg]."""
    difference, angle = _data()
    basis = odd_exponential_basis(difference / scale)
    result = np.linalg.lstsq(basis, angle, rcond=None)[0]
    return tuple(float(a) for a in result), rms(basis @ result - angle)


@recomputes("matiskova2021-09")
def _fitted_in_bar() -> Recomputed:
    result, misfit = _fit(PA_PER_BAR)
    return Recomputed(result, rms=misfit)


@recomputes("matiskova2021-10")
def _fitted_with_scale() -> Recomputed:
    best = minimize_scalar(
        lambda scale: _fit(float(scale))[1], bounds=(0.3e5, 6e5), method="bounded"
    )
    result, misfit = _fit(float(best.x))
    return Recomputed(result, scale=best.x / PA_PER_KPA, rms=misfit)


def _within_scatter(misfit: float, **evidence: Any) -> Recomputed:
    """An RMS misfit [deg] that must be within the scatter of the rows to describe them."""
    scatter = printed_rows_law().left_out_rms_deg
    return Recomputed(misfit, high=scatter, rows_deg=scatter, **evidence)


@recomputes("matiskova2021-11", each=("rms_bar_deg", "rms_scaled_deg"))
def _printed_law(key: str) -> Recomputed:
    result = static_characteristic()
    return _within_scatter(result[key], scale=result["scale_kpa"])


@recomputes("matiskova2021-13")
def _origin() -> Recomputed:
    at_zero = propagated(lambda a0, a1, _: a0 + a1, *_LAW)
    return Recomputed(at_zero, low=0.0, high=0.0, jump=2.0 * at_zero.value)


@recomputes("matiskova2021-14")
def _end_value() -> Recomputed:
    def top(a1: float, a2: float) -> float:
        return 1.0 - a1 / a2  # where (a2 - a1 - a2 x) exp(-x) = 0

    highest = propagated(
        lambda a0, a1, a2: a0 + (a1 + a2 * top(a1, a2)) * math.exp(-top(a1, a2)),
        *_LAW,
    )
    return Recomputed(highest, top=top(_LAW[1].value, _LAW[2].value))


@recomputes("matiskova2021-15")
def _decreasing() -> Recomputed:
    a1, a2 = (number.value for number in _LAW[1:])
    x = np.array([0.0, 5.0])  # 0 and 500 kPa, read in bar
    slope = (a2 - a1 - a2 * x) * np.exp(-x)
    unloaded = np.array([step.load == 0.0 for step in distinct_steps()])
    size, turn = (np.abs(column[unloaded]) for column in _data())
    order = np.argsort(size)
    # Three groups of steps, each averaged: single neighbours lie within the scatter.
    means = [(size[group].mean(), turn[group].mean()) for group in np.array_split(order, 3)]
    secants = [
        (b[1] - a[1]) / (b[0] - a[0]) * PA_PER_KPA
        for a, b in itertools.pairwise([(0.0, 0.0), *means])
    ]
    return Recomputed(
        tuple(float(s) for s in secants), order=Order.FALLING, first=slope[0], last=slope[1]
    )


@recomputes("matiskova2021-16")
def _proportional() -> Recomputed:
    difference, angle = _data()
    gains = angle / difference * PA_PER_KPA
    slope = float(difference @ angle / (difference @ difference))
    return _within_scatter(rms(slope * difference - angle), least=gains.min(), most=gains.max())
