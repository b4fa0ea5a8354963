"""The static law (17), (23) against Tables 1 and 2, and the sentences on its course."""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from pamsim.core.units import DEG_PER_RAD, PA_PER_BAR, PA_PER_KPA
from pamsim.papers.claim import Recomputed, recomputes
from pamsim.papers.paper_models import odd_exponential_basis, static_characteristic
from pamsim.store.printed import distinct_steps, mas20_models

FloatArray = NDArray[np.float64]

_ANGLE_LIMIT = 0.144
"""RMS misfit up to which a curve passes through the tables [deg]: one encoder increment."""


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


def _printed() -> tuple[float, float, float]:
    law = mas20_models()["static"]
    return float(law["a0_deg"]), float(law["a1_deg"]), float(law["a2_deg"])


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


@recomputes("matiskova2021-11")
def _printed_in_bar() -> Recomputed:
    rms = float(static_characteristic()["rms_bar_deg"])
    return Recomputed(rms)


@recomputes("matiskova2021-12")
def _printed_with_scale() -> Recomputed:
    result = static_characteristic()
    return Recomputed(float(result["rms_scaled_deg"]), scale=result["scale_kpa"])


@recomputes("matiskova2021-13")
def _origin() -> Recomputed:
    a0, a1, _ = _printed()
    return Recomputed(a0 + a1, jump=2.0 * (a0 + a1))


@recomputes("matiskova2021-14")
def _end_value() -> Recomputed:
    a0, a1, a2 = _printed()
    top = 1.0 - a1 / a2  # where (a2 - a1 - a2 x) exp(-x) = 0
    highest = a0 + (a1 + a2 * top) * math.exp(-top)
    return Recomputed(highest, top=top)


@recomputes("matiskova2021-15")
def _decreasing() -> Recomputed:
    _, a1, a2 = _printed()
    x = np.linspace(0.0, 5.0, 501)  # 0 to 500 kPa, read in bar
    slope = (a2 - a1 - a2 * x) * np.exp(-x)
    falls = bool(np.all(np.diff(slope) < 0.0))
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
        tuple(float(s) for s in secants),
        holds=falls and secants[0] > secants[1] > secants[2],
        first=slope[0],
        last=slope[-1],
    )


@recomputes("matiskova2021-16")
def _proportional() -> Recomputed:
    difference, angle = _data()
    gains = angle / difference * PA_PER_KPA
    slope = float(difference @ angle / (difference @ difference))
    rms = float(np.sqrt(np.mean((slope * difference - angle) ** 2)))
    return Recomputed((float(gains.min()), float(gains.max())), holds=rms <= _ANGLE_LIMIT, rms=rms)
