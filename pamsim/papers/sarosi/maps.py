"""Measured force maps of Festo muscles, and the laws of Sarosi fitted to them."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from pamsim.core.units import DEG_PER_RAD, PA_PER_BAR
from pamsim.muscles.braid import Braid
from pamsim.muscles.catalog import FORCE_LAWS
from pamsim.papers.claim import printed_number
from pamsim.store.printed import printed_table

FloatArray = NDArray[np.float64]

MAPS = {"DMSP-20": "dmsp20_300_force_map.csv", "DMSP-10": "dmsp10_250_force_map.csv"}
"""Diameter -> published force map (Martens and Boblan, Actuators 2017, 6, 33)."""


@dataclass(frozen=True, kw_only=True)
class MeasuredForces:
    """Points of a map where the muscle pulled: gauge pressure [Pa], contraction [-], force [N]."""

    pressure: FloatArray
    contraction: FloatArray
    force: FloatArray


@functools.cache
def measured(kind: str) -> MeasuredForces:
    """A map without its zeros, which mean slack or not measured."""
    names = ("p_gauge_Pa", "contraction_ratio", "force_N")
    table = np.array([[float(row[name]) for name in names] for row in printed_table(MAPS[kind])])
    table = table[table[:, 2] != 0.0]
    return MeasuredForces(pressure=table[:, 0], contraction=table[:, 1], force=table[:, 2])


def dmsp_20_braid() -> Braid:
    """Geometry of the mapped DMSP-20-300N as Nguyen 2024 prints it; Sarosi prints none."""
    return Braid(
        nominal_length=printed_number("nguyen2024", "free_length").value * 1e-3,
        diameter=printed_number("nguyen2024", "diameter").value * 1e-3,
        fibre_angle=printed_number("nguyen2024", "fibre_angle").value / DEG_PER_RAD,
    )


def predicted(law: str, coefficients: tuple[float, ...], points: MeasuredForces) -> FloatArray:
    """Forces of a law of the catalog at the points of a map [N]."""
    entry, braid = FORCE_LAWS[law], dmsp_20_braid()
    pairs = zip(points.pressure.tolist(), points.contraction.tolist(), strict=True)
    return np.array([entry.force(p, kappa, coefficients, braid) for p, kappa in pairs])


@functools.cache
def fitted_residual(law: str) -> FloatArray:
    """Predicted less measured force on the DMSP-20 map after a least-squares fit [N].

    Args:
        law: ``ideal`` (nothing to fit), ``strain`` ((2) with mu constant), ``corrected`` ((2)) or
            ``exponential`` ((4)).
    """
    points = measured("DMSP-20")
    if law == "ideal":
        return predicted("ideal_mckibben", (1.0,), points) - points.force
    decay = printed_number("sarosi", "decay").value
    if law == "exponential":
        bar = PA_PER_BAR
        return _fitted(
            lambda v: (
                predicted(
                    "invertible_exponential",
                    (1.0, v[0] / bar, v[1], v[2], v[3] / bar, v[4], v[5] / bar, v[6]),
                    points,
                )
                - points.force
            ),
            [0.0, 300.0, -30.0, -900.0, 0.0, 300.0, -300.0],
        )
    if law == "strain":
        return _fitted(
            lambda v: (
                predicted("corrected_mckibben", (1.0, v[0], v[1], 0.0, v[2], decay), points)
                - points.force
            ),
            [1.0, -1.0, -1.0],
        )
    return _fitted(
        lambda v: predicted("corrected_mckibben", (1.0, *v, decay), points) - points.force,
        [1.0, -1.0, 0.1, -1.0],
    )


def _fitted(residual: Callable[[FloatArray], FloatArray], start: list[float]) -> FloatArray:
    return least_squares(residual, start, x_scale="jac", max_nfev=2000).fun


def rms(values: FloatArray) -> float:
    """Root of the mean square, in the unit of the values."""
    return float(np.sqrt(np.mean(values**2)))
