"""Curves of Sarosi: its force laws at 1 to 6 bar and their inverse, by themselves and on the bench.

The paper prints no constants. (4) has those that its group published for the same muscle; (2) is
fitted to (4), so that the two forms can be compared; (1) has the fibre angle of Nguyen 2024.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from pamsim.core.units import PA_PER_BAR, FloatArray
from pamsim.engine.rig import Rig
from pamsim.papers.bench_experiments import bench, hanging_weight, hung, stretched
from pamsim.papers.nguyen2024.geometry import muscle
from pamsim.papers.numerics import rms, root
from pamsim.papers.sarosi import equations
from pamsim.papers.sarosi.equations import BARS, TYPE, MeasuredForces, fitted, measured
from pamsim.physics.braid import max_contraction
from pamsim.physics.force_laws.catalog import FORCE_LAWS

_CONTRACTION = np.linspace(0.0, 0.25, 101)
_WANTED = (0.0, 200.0, 400.0, 600.0, 800.0, 1000.0)  # forces of the inverse [N]
_HIGHEST_BAR = 8.0  # what the maker allows for this size is less; shown are fillings up to this
_TOP = BARS[-1] * PA_PER_BAR
_HELD = np.linspace(0.0, 0.25, 11)
"""Contractions at which the muscle is held [-]."""
_LOADS = (0.0, 10.0, 30.0)
"""Weights that hang on the rod [kg]."""
_RISE, _SWEEP = 0.6, 8.0
"""Time for 0 to 6 bar at a held length, and for 0 to 6 bar and back with a weight [s]."""


def _pressures(force: FloatArray | float, contraction: FloatArray) -> FloatArray:
    """Gauge pressures [bar] by (5) that give forces [N] at contractions [-]."""
    return np.vectorize(equations.pressure_for)(force, contraction) / PA_PER_BAR


def curves() -> Mapping[str, Any]:
    """Force [N] over contraction by every law, and gauge pressure [bar] over it by (5).

    Of (5) what no allowed filling gives is NaN; ``round_trip_bar`` is its largest error after (4).
    """
    exponential = _family(equations.force)
    # From 2 bar on, as the paper says, and where (4) pulls.
    grid = [
        (bar * PA_PER_BAR, kappa, force)
        for bar in BARS[1:]
        for kappa, force in zip(_CONTRACTION[::5], exponential[f"{bar:g} bar"][::5], strict=True)
        if force > 0.0
    ]
    corrected, residual = fitted("corrected", MeasuredForces(*np.array(grid).T))
    inverse = {f"{force:g} N": _pressures(force, _CONTRACTION) for force in _WANTED}
    back = [_pressures(exponential[f"{bar:g} bar"], _CONTRACTION) - bar for bar in BARS]
    return {
        "muscle": TYPE,
        "ideal_end_percent": 100.0 * max_contraction(muscle().fibre_angle),
        "contraction_percent": 100.0 * _CONTRACTION,
        "ideal": _family(lambda p, k: FORCE_LAWS["ideal_mckibben"].force(p, k, (1.0,), muscle())),
        "corrected": _family(
            lambda p, k: FORCE_LAWS["corrected_mckibben"].force(p, k, corrected, muscle())
        ),
        "exponential": exponential,
        "fit": {"rms_n": rms(residual)},
        "inverse": {
            name: np.where((bar >= 0.0) & (bar <= _HIGHEST_BAR), bar, np.nan)
            for name, bar in inverse.items()
        },
        "round_trip_bar": float(np.max(np.abs(back))),
        "bench": bench_curves(),
    }


def _family(law: Callable[[float, float], float]) -> dict[str, FloatArray]:
    return {
        f"{bar:g} bar": np.array([law(bar * PA_PER_BAR, float(k)) for k in _CONTRACTION])
        for bar in BARS
    }


def force_by_law(pressure: float, contraction: float) -> float:
    """Tension by (4) [N] at a gauge pressure [Pa]: its force, or none where it would push."""
    return max(equations.force(pressure, contraction), 0.0)


def contraction_by_law(pressure: float, weight: float) -> float:
    """Contraction [-] at which (4) carries a weight, more than none [N], at a gauge pressure."""
    return root(lambda k: force_by_law(pressure, k) - weight, -0.1, 0.6, 1e-13)


def bench_curves() -> Mapping[str, Any]:
    """Force at held lengths and length under weights, by the engine and by (4).

    What ends with ``off`` and a unit is the largest distance of the two; ``end_percent`` are the
    contractions at 6 bar with the rod alone, and by (4) without any force; ``map_rms_n`` are the
    distances of both from the published force map.
    """
    rig = bench("sarosi")
    # Evenly spaced to 6 bar: every tenth sample is a whole bar.
    time = np.linspace(0.0, _RISE, 61)
    ramp = time / _RISE * _TOP
    forces = np.array([_held(rig, time, k, ramp) for k in _HELD.tolist()])
    exact = np.array([[force_by_law(float(p), float(k)) for p in ramp] for k in _HELD])
    hanging = {f"{load:g} kg": isotonic(rig, load) for load in _LOADS}
    return {
        "held_percent": 100.0 * _HELD,
        "isometric": {f"{bar:g} bar": forces[:, round(10 * bar)] for bar in BARS},
        "isometric_off_n": float(np.max(np.abs(forces - exact))),
        "isotonic": hanging,
        "end_percent": {
            "engine": float(hanging["0 kg"]["contraction_percent"].max()),
            "law": 100.0 * contraction_by_law(_TOP, hanging_weight(rig, 0.0)),
            "law_free": 100.0 * contraction_by_law(_TOP, 1e-9),
        },
        "map_rms_n": _distance_from_map(rig, time),
    }


def _held(rig: Rig, time: FloatArray, contraction: float, pressure: FloatArray) -> FloatArray:
    return stretched(rig, time, np.full(time.shape, contraction), pressure).tension


def _distance_from_map(rig: Rig, time: FloatArray) -> Mapping[str, float]:
    """Engine and (4) at the points of the published force map where it pulls."""
    points = measured("DMSP-20")
    ramp = time / _RISE * points.pressure.max()
    engine = np.zeros(points.force.shape)
    for kappa in np.unique(points.contraction):
        here = points.contraction == kappa
        engine[here] = np.interp(points.pressure[here], ramp, _held(rig, time, kappa, ramp))
    pairs = zip(points.pressure.tolist(), points.contraction.tolist(), strict=True)
    law = np.array([force_by_law(*pair) for pair in pairs])
    return {"engine": rms(engine - points.force), "law": rms(law - points.force)}


def isotonic(rig: Rig, load: float) -> Mapping[str, Any]:
    """Pressure up to 6 bar and down again with a weight [kg] on the bench."""
    weight = hanging_weight(rig, load)
    time = np.linspace(0.0, _SWEEP, 401)
    pressure = 3.0 * PA_PER_BAR * (1.0 - np.cos(2.0 * np.pi * time / _SWEEP))
    run = hung(rig, time, pressure, load=load)
    exact = np.array([contraction_by_law(float(p), weight) for p in run.pressure])
    return {
        "contraction_percent": 100.0 * run.contraction,
        "pressure_bar": run.pressure / PA_PER_BAR,
        "inverse_bar": _pressures(weight, run.contraction),
        "off_percent": 100.0 * float(np.max(np.abs(run.contraction - exact))),
    }
