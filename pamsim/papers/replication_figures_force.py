"""Curves of Sarosi's figures: its force laws at 1 to 6 bar, and the inverse of the last one.

The paper prints no constants. (4) has those that its group published for the same muscle; (2) is
fitted to (4), so that the two forms can be compared; (1) has the fibre angle of Nguyen 2024.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from pamsim.core.units import DEG_PER_RAD, PA_PER_BAR, FloatArray
from pamsim.papers.numerics import curve_fit
from pamsim.papers.sarosi.inverse import pressure_for
from pamsim.physics.braid import max_contraction
from pamsim.physics.force_laws.exponential import six_parameter_force
from pamsim.physics.force_laws.force_law import coefficients_of
from pamsim.physics.force_laws.mckibben import corrected_mckibben_force, ideal_force
from pamsim.physics.force_laws.published import PUBLISHED

_MUSCLE = "DMSP-20-200"  # the one Sarosi measures
_LENGTH, _DIAMETER, _FIBRE_ANGLE = 0.200, 0.020, 28.6 / DEG_PER_RAD
_CONTRACTION = np.linspace(0.0, 0.25, 101)
_BARS = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
_WANTED = (0.0, 200.0, 400.0, 600.0, 800.0, 1000.0)  # forces of the inverse [N]
_HIGHEST_BAR = 8.0  # what the maker allows for this size is less; shown are fillings up to this
_START = (1.0, -1.2, 0.3, -1.0)  # a_eps, b_eps, a_kappa, b_kappa of (2): near the ideal law
_DECAY = 40.0  # printed in (2)


def force_curves() -> Mapping[str, Any]:
    """Force over contraction by every law, and pressure over contraction by (5).

    Returns:
        ``contraction_percent`` (n,) [%]; ``ideal``, ``corrected`` and ``exponential``: pressure ->
        (n,) force [N]; ``fit``: constants of (2) and its RMS misfit to (4) [N];
        ``ideal_end_percent``: where (1) ends [%]; ``inverse``: force -> (n,) gauge pressure [bar],
        NaN where no allowed filling gives it; ``round_trip_bar``: largest error of (5) after (4).
    """
    law = PUBLISHED[_MUSCLE]
    constants = coefficients_of(law)[1:]
    exponential = _curves(lambda p, k: six_parameter_force(p, k, *constants))
    fitted, rms = _fit_corrected(exponential)
    geometry = (_DIAMETER, _FIBRE_ANGLE)
    inverse = {
        f"{force:g} N": _allowed(
            np.array([pressure_for(law, force, float(k)) for k in _CONTRACTION])
        )
        for force in _WANTED
    }
    back = [
        pressure_for(law, float(force), float(k)) / PA_PER_BAR - bar
        for bar in _BARS
        for k, force in zip(_CONTRACTION, exponential[f"{bar:g} bar"], strict=True)
    ]
    return {
        "muscle": _MUSCLE,
        "ideal_end_percent": 100.0 * max_contraction(_FIBRE_ANGLE),
        "contraction_percent": 100.0 * _CONTRACTION,
        "ideal": _curves(lambda p, k: ideal_force(p, (1.0 - k) * _LENGTH, _LENGTH, *geometry)),
        "corrected": _curves(
            lambda p, k: corrected_mckibben_force(p, k, *fitted, _DECAY, *geometry)
        ),
        "exponential": exponential,
        "fit": {
            **dict(zip(("a_eps", "b_eps", "a_kappa", "b_kappa"), fitted, strict=True)),
            "rms_n": rms,
        },
        "inverse": inverse,
        "round_trip_bar": float(np.max(np.abs(back))),
    }


def _curves(law: Any) -> dict[str, FloatArray]:
    return {
        f"{bar:g} bar": np.array([law(bar * PA_PER_BAR, float(k)) for k in _CONTRACTION])
        for bar in _BARS
    }


def _fit_corrected(
    target: Mapping[str, FloatArray],
) -> tuple[tuple[float, float, float, float], float]:
    """Constants of (2) by least squares on (4) where it pulls, from 2 bar on as the paper says."""
    chosen = [
        (bar * PA_PER_BAR, float(k), float(force))
        for bar in _BARS[1:]
        for k, force in zip(_CONTRACTION[::5], target[f"{bar:g} bar"][::5], strict=True)
        if force > 0.0
    ]

    def force(_: None, a: float, b: float, c: float, d: float) -> FloatArray:
        law = (a, b, c, d, _DECAY, _DIAMETER, _FIBRE_ANGLE)
        return np.array([corrected_mckibben_force(p, k, *law) for p, k, _ in chosen])

    wanted = np.array([f for _, _, f in chosen])
    fitted, _ = curve_fit(force, None, wanted, _START, method="trf")
    rms = float(np.sqrt(np.mean((force(None, *fitted) - wanted) ** 2)))
    a_eps, b_eps, a_kappa, b_kappa = (float(value) for value in fitted)
    return (a_eps, b_eps, a_kappa, b_kappa), rms


def _allowed(pressure: FloatArray) -> FloatArray:
    """Pressures in bar, NaN where none from 0 to the highest gives the force."""
    bar = pressure / PA_PER_BAR
    return np.where((bar >= 0.0) & (bar <= _HIGHEST_BAR), bar, np.nan)
