"""Sarosi on the bench: isometric and isotonic curves of (4), and where a hung muscle ends."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from pamsim.core.units import PA_PER_BAR
from pamsim.engine.rig import Rig
from pamsim.papers.bench_experiments import bench, hanging_weight, hung, stretched
from pamsim.papers.numerics import root
from pamsim.papers.sarosi.inverse import pressure_for
from pamsim.papers.sarosi.maps import measured, rms
from pamsim.physics.force_laws.exponential import six_parameter_force
from pamsim.physics.force_laws.force_law import coefficients_of
from pamsim.physics.force_laws.published import PUBLISHED

_LAW = PUBLISHED["DMSP-20-200"]
_BARS = np.arange(1.0, 7.0)
_HELD = np.linspace(0.0, 0.25, 11)
"""Contractions at which the muscle is held [-]."""
_LOADS = (0.0, 10.0, 30.0)
"""Weights that hang on the rod [kg]."""
_RISE, _SWEEP = 0.6, 8.0
"""Time for 0 to 6 bar at a held length, and for 0 to 6 bar and back with a weight [s]."""


def force_by_law(pressure: float, contraction: float) -> float:
    """Tension by (4) [N]: its force, or none where it would push.

    Args:
        pressure: gauge [Pa].
        contraction: [-].
    """
    return max(six_parameter_force(pressure, contraction, *coefficients_of(_LAW)[1:]), 0.0)


def contraction_by_law(pressure: float, weight: float) -> float:
    """Contraction [-] at which (4) carries a weight.

    Args:
        pressure: gauge [Pa].
        weight: more than none [N].
    """
    return root(lambda k: force_by_law(pressure, k) - weight, -0.1, 0.6, 1e-13)


def bench_curves() -> Mapping[str, Any]:
    """Force at held lengths and length under weights, by the engine and by (4).

    Returns:
        ``held_percent`` (n,) [%]; ``isometric``: pressure -> (n,) force [N], engine;
        ``isometric_off_n``: its largest distance from (4) [N]; ``isotonic``: weight ->
        ``contraction_percent``, ``pressure_bar`` of the engine and ``inverse_bar`` by (5) for that
        weight (m,), and ``off_percent``, the largest distance from (4) in contraction [%];
        ``end_percent``: contraction at 6 bar without a load, by engine and by (4), and by (4)
        without any force [%]; ``map_rms_n``: distance from the published force map at its own
        points, of the engine and of (4) [N].
    """
    rig = bench("sarosi")
    # Evenly spaced to 6 bar: every tenth sample is a whole bar.
    time = np.linspace(0.0, _RISE, 61)
    ramp = time / _RISE * _BARS[-1] * PA_PER_BAR
    whole = 10 * np.arange(1, 7)
    forces = np.array(
        [stretched(rig, time, np.full(time.shape, k), ramp).tension for k in _HELD.tolist()]
    )
    exact = np.array([[force_by_law(float(p), float(k)) for p in ramp] for k in _HELD])
    hanging = {f"{load:g} kg": isotonic(rig, load) for load in _LOADS}
    weight, top = hanging_weight(rig, 0.0), float(_BARS[-1]) * PA_PER_BAR
    return {
        "held_percent": 100.0 * _HELD,
        "isometric": {f"{bar:g} bar": forces[:, i] for bar, i in zip(_BARS, whole, strict=True)},
        "isometric_off_n": float(np.max(np.abs(forces - exact))),
        "isotonic": hanging,
        "end_percent": {
            "engine": float(hanging["0 kg"]["contraction_percent"].max()),
            "law": 100.0 * contraction_by_law(top, weight),
            "law_free": 100.0 * contraction_by_law(top, 1e-9),
        },
        "map_rms_n": _distance_from_map(rig),
    }


def _distance_from_map(rig: Rig) -> Mapping[str, float]:
    """Engine and (4) at the points of the published force map where it pulls."""
    points = measured("DMSP-20")
    time = np.linspace(0.0, _RISE, 61)
    ramp = time / _RISE * points.pressure.max()
    engine = np.zeros(points.force.shape)
    for kappa in np.unique(points.contraction):
        here = points.contraction == kappa
        force = stretched(rig, time, np.full(time.shape, kappa), ramp).tension
        engine[here] = np.interp(points.pressure[here], ramp, force)
    pairs = zip(points.pressure.tolist(), points.contraction.tolist(), strict=True)
    law = np.array([force_by_law(*pair) for pair in pairs])
    return {"engine": rms(engine - points.force), "law": rms(law - points.force)}


def isotonic(rig: Rig, load: float) -> Mapping[str, Any]:
    """Pressure up to 6 bar and down again with a weight, see `bench_curves`.

    Args:
        rig: the bench.
        load: below the rod [kg].
    """
    weight = hanging_weight(rig, load)
    time = np.linspace(0.0, _SWEEP, 401)
    pressure = 3.0 * PA_PER_BAR * (1.0 - np.cos(2.0 * np.pi * time / _SWEEP))
    run = hung(rig, time, pressure, load=load)
    exact = np.array([contraction_by_law(float(p), weight) for p in run.pressure])
    return {
        "contraction_percent": 100.0 * run.contraction,
        "pressure_bar": run.pressure / PA_PER_BAR,
        "inverse_bar": np.array([pressure_for(_LAW, weight, float(k)) for k in run.contraction])
        / PA_PER_BAR,
        "off_percent": 100.0 * float(np.max(np.abs(run.contraction - exact))),
    }
