"""Measured force maps of Festo muscles, and the laws of Sarosi fitted to them."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from pamsim.core.units import DEG_PER_RAD, PA_PER_BAR, FloatArray
from pamsim.papers.claim import printed_number
from pamsim.papers.numerics import curve_fit
from pamsim.physics.braid import Braid
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.recordings.printed import printed_table

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
    decay, bar = printed_number("sarosi", "decay").value, PA_PER_BAR
    name, coefficients, start = {
        "exponential": (
            "invertible_exponential",
            lambda a, b, c, e, f, g, h: (1.0, a / bar, b, c, e / bar, f, g / bar, h),
            [0.0, 300.0, -30.0, -900.0, 0.0, 300.0, -300.0],
        ),
        "strain": (
            "corrected_mckibben",
            lambda a, b, factor: (1.0, a, b, 0.0, factor, decay),
            [1.0, -1.0, -1.0],
        ),
        "corrected": (
            "corrected_mckibben",
            lambda *v: (1.0, *v, decay),
            [1.0, -1.0, 0.1, -1.0],
        ),
    }[law]

    def force(_: None, *values: float) -> FloatArray:
        return predicted(name, coefficients(*values), points)

    fitted, _ = curve_fit(
        force, None, points.force, start, method="trf", x_scale="jac", max_nfev=2000
    )
    return force(None, *fitted) - points.force


def rms(values: FloatArray) -> float:
    """Root of the mean square, in the unit of the values."""
    return float(np.sqrt(np.mean(values**2)))
