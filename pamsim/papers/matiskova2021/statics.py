"""The static law (17), (23) against Tables 1 and 2, and the sentences on its course."""

from __future__ import annotations

import itertools
import math

import numpy as np
from scipy.optimize import minimize_scalar

from pamsim.core.units import DEG_PER_RAD, PA_PER_BAR, PA_PER_KPA, FloatArray
from pamsim.papers.claim import Order, Recomputed, recomputes
from pamsim.papers.paper_models import odd_exponential_basis, static_characteristic
from pamsim.papers.rounding import propagated
from pamsim.papers.torque_law import printed_rows_law
from pamsim.recordings.printed import Printed, distinct_steps, printed_document


def _data() -> tuple[FloatArray, FloatArray]:
    """Pressure difference [Pa] and angle [deg] of the distinct rows."""
    steps = distinct_steps()
    difference = np.array([step.pressure[0] - step.pressure[1] for step in steps])
    return difference, np.array([step.angle for step in steps]) * DEG_PER_RAD


def _fit(scale: float) -> tuple[tuple[float, ...], float]:
    """Least squares of (17), continued as an odd function: coefficients and RMS [deg]."""
    difference, angle = _data()
    basis = odd_exponential_basis(difference / scale)
    result = np.linalg.lstsq(basis, angle, rcond=None)[0]
    return tuple(float(a) for a in result), float(np.sqrt(np.mean((basis @ result - angle) ** 2)))


def _printed() -> tuple[Printed, Printed, Printed]:
    law = printed_document("matiskova2021.toml", digits=True)["static"]
    return law["a0_deg"], law["a1_deg"], law["a2_deg"]


@recomputes("matiskova2021-09")
def _fitted_in_bar() -> Recomputed:
    result, rms = _fit(PA_PER_BAR)
    return Recomputed(result, rms=rms)


@recomputes("matiskova2021-10")
def _fitted_with_scale() -> Recomputed:
    best = minimize_scalar(
        lambda scale: _fit(float(scale))[1], bounds=(0.3e5, 6e5), method="bounded"
    )
    result, rms = _fit(float(best.x))
    return Recomputed(result, scale=best.x / PA_PER_KPA, rms=rms)


def _row_scatter() -> float:
    """Largest RMS misfit that counts as a description of the rows [deg]."""
    return printed_rows_law().left_out_rms_deg


@recomputes("matiskova2021-11")
def _printed_in_bar() -> Recomputed:
    rms = float(static_characteristic()["rms_bar_deg"])
    return Recomputed(rms, high=_row_scatter(), rows_deg=_row_scatter())


@recomputes("matiskova2021-12")
def _printed_with_scale() -> Recomputed:
    result = static_characteristic()
    return Recomputed(
        float(result["rms_scaled_deg"]),
        high=_row_scatter(),
        scale=result["scale_kpa"],
        rows_deg=_row_scatter(),
    )


@recomputes("matiskova2021-13")
def _origin() -> Recomputed:
    at_zero = propagated(lambda a0, a1, _: a0 + a1, *_printed())
    return Recomputed(at_zero, low=0.0, high=0.0, jump=2.0 * at_zero.value)


@recomputes("matiskova2021-14")
def _end_value() -> Recomputed:
    def top(a1: float, a2: float) -> float:
        return 1.0 - a1 / a2  # where (a2 - a1 - a2 x) exp(-x) = 0

    highest = propagated(
        lambda a0, a1, a2: a0 + (a1 + a2 * top(a1, a2)) * math.exp(-top(a1, a2)), *_printed()
    )
    return Recomputed(highest, top=top(_printed()[1].value, _printed()[2].value))


@recomputes("matiskova2021-15")
def _decreasing() -> Recomputed:
    _, a1, a2 = (number.value for number in _printed())
    x = np.array([0.0, 5.0])  # 0 and 500 kPa, read in bar
    slope = (a2 - a1 - a2 * x) * np.exp(-x)
    difference, angle = _data()
    unloaded = np.array([step.load == 0.0 for step in distinct_steps()])
    order = np.argsort(np.abs(difference[unloaded]))
    size, turn = np.abs(difference[unloaded])[order], np.abs(angle[unloaded])[order]
    # Three groups of steps, each averaged: single neighbours lie within the scatter.
    means = [
        (size[group].mean(), turn[group].mean())
        for group in np.array_split(np.arange(len(size)), 3)
    ]
    points = [(0.0, 0.0), *means]
    secants = [(b[1] - a[1]) / (b[0] - a[0]) * PA_PER_KPA for a, b in itertools.pairwise(points)]
    return Recomputed(
        tuple(float(s) for s in secants), order=Order.FALLING, first=slope[0], last=slope[1]
    )


@recomputes("matiskova2021-16")
def _proportional() -> Recomputed:
    difference, angle = _data()
    gains = angle / difference * PA_PER_KPA
    slope = float(difference @ angle / (difference @ difference))
    rms = float(np.sqrt(np.mean((slope * difference - angle) ** 2)))
    return Recomputed(
        rms,
        high=_row_scatter(),
        least=gains.min(),
        most=gains.max(),
        rows_deg=_row_scatter(),
    )
