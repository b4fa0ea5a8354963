"""Curves of Van Damme 2008: plane, loops and force by relays, and tensile loops on the bench.

The paper fits its polynomial to measurements that it does not print: here the polynomial is the
least-squares fit to the exact shape for many fibres.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from pamsim.core.units import PA_PER_BAR, FloatArray
from pamsim.papers.bench_experiments import bench, stretched
from pamsim.papers.vandamme2008.loop import (
    RelaySum,
    levels_of,
    line_slope,
    major_loop,
    printed_weight,
    relay_weights,
    scaled,
)
from pamsim.papers.vandamme2008.shape import (
    PERCENT,
    exact,
    largest,
    length,
    polynomial,
    pressures,
    value,
)
from pamsim.physics.force_laws.pleated import FIT_RANGE, pleated_max_contraction

_LEVELS = 80
"""Of the grid in the bench's params.toml: twice as many move no curve by more than its width."""
_HISTORY = (-1.0, 0.75, -0.55, 0.45, -0.2, 0.1)  # turning points that leave a staircase
_LOW, _HIGH = 0.07, 0.20  # contractions between which the paper finds its model good
_FIBRES = (40, 25)
_SPEED = 0.25
"""Of the loops on the bench, contraction per second [1/s]: they do not depend on it."""
_PERIOD = 0.01  # between two samples [s]
_TURNS = (0.05, 0.35, 0.05, 0.35, _LOW, _HIGH, _LOW)
"""Contractions at which the machine turns: a whole loop, then one inside it [-]."""
_WHOLE = slice(120, 361)
"""Samples of the whole loop: from the first 35 % to the second."""
_ONE = 1.5 * PA_PER_BAR
"""Pressure of Figures 9 and 10 [Pa]."""


@functools.cache
def _weights() -> FloatArray:
    return relay_weights(_LEVELS, printed_weight)


def _path(turns: Iterable[float], step: float) -> FloatArray:
    """Contractions in even steps from turn to turn [-]."""
    points = list(turns)
    legs = [
        np.linspace(start, end, round(abs(end - start) / step) + 1)[1:]
        for start, end in itertools.pairwise(points)
    ]
    return np.concatenate([points[:1], *legs])


def _relative_output(contraction: FloatArray, *, virgin: bool) -> FloatArray:
    """W - W_fit along a path from a virgin muscle or from lower saturation, relay by relay [-]."""
    relays, u = RelaySum(_weights()), scaled(contraction)
    if not virgin:
        relays.step(-1.1)
    return np.array([relays.step(each) for each in u.tolist()]) - line_slope(_weights()) * u


def curves() -> Mapping[str, Any]:
    """Plane, loops and force functions [-] of Figures 2, 3 and 11 to 15; forces of 25 fibres [N].

    The loops are by number of fibres, the forces by pressure.
    """
    levels, plane = levels_of(_LEVELS), RelaySum(_weights())
    for u in _HISTORY:
        plane.step(u)
    whole_cells = _weights() * (1.0 + np.eye(_LEVELS))
    rising, falling = major_loop(_weights())
    step = largest() / _LEVELS
    outer = _path((0.0, largest(), 0.0), step)
    inner = _path((0.0, largest(), _LOW, _HIGH, _LOW), step)
    outer_error, inner_error = (_relative_output(way, virgin=False) for way in (outer, inner))
    # The way in from saturation is no part of the closed inner loop.
    closed = len(inner) - len(_path((_LOW, _HIGH, _LOW), step))
    inner, inner_error = inner[closed:], inner_error[closed:]
    valid = outer >= FIT_RANGE[0]
    outer, outer_error = outer[valid], outer_error[valid]
    loops = {
        str(fibres): {
            "delta": value(f"delta_{fibres}"),
            "value": polynomial(outer) * (1.0 + value(f"delta_{fibres}") * outer_error),
            "inner_percent": inner / PERCENT,
            "inner_value": polynomial(inner) * (1.0 + value(f"delta_{fibres}") * inner_error),
        }
        for fibres in _FIBRES
    }
    slenderness = value("slenderness")
    whole = np.linspace(0.005, pleated_max_contraction(slenderness), 200)
    return {
        "plane": {
            "levels": levels,
            # Relays of the diagonal stand for half a cell: full height again, for the picture only.
            "weight": whole_cells / whole_cells.max(),
            "relays": plane.relays,
            "history": list(_HISTORY),
        },
        "major": {
            "input": levels,
            "rising": rising,
            "falling": falling,
            "line": line_slope(_weights()) * levels,
        },
        "contraction_percent": outer / PERCENT,
        "static": polynomial(outer),
        "loops": loops,
        "forces": {
            f"{p / PA_PER_BAR:g} bar": p * length() ** 2 * loops["25"]["value"] for p in pressures()
        },
        "exact": {
            "contraction_percent": whole / PERCENT,
            "exact": exact(whole, slenderness),
            "polynomial": polynomial(whole),
            "range_percent": [end / PERCENT for end in FIT_RANGE],
        },
        "bench": bench_curves(),
    }


def bench_curves() -> Mapping[str, Any]:
    """Loops of the engine beside (7), relay by relay, by number of fibres at 1.5 bar.

    Of each the relative error e, (4), is ``error_percent`` by the engine and ``law_percent`` by
    (6), ``off_percent`` the largest distance of the two; ``width_percent`` is the widest distance
    of the branches of the ``whole`` loop. Forces are of 25 fibres, ``static_n`` without memory;
    between their pressures e differs by ``pressure_spread_percent``.
    """
    contraction = _path(_TURNS, _SPEED * _PERIOD)
    fit, area = polynomial(contraction), length() ** 2
    by_relays = _relative_output(contraction, virgin=True)
    loops: dict[str, Any] = {}
    for fibres in _FIBRES:
        function = _tension(fibres, _ONE, contraction) / (_ONE * area)
        error, by_law = 100.0 * (function / fit - 1.0), 100.0 * value(f"delta_{fibres}") * by_relays
        loops[str(fibres)] = {
            "function": function,
            "error_percent": error,
            "law_percent": by_law,
            "width_percent": {"engine": _width(error), "law": _width(by_law)},
            "off_percent": float(np.max(np.abs(error - by_law))),
        }
    forces = {p: _tension(25, p, contraction) for p in pressures()}
    spread = np.ptp([force / (p * area * fit) for p, force in forces.items()], axis=0)
    return {
        "contraction_percent": contraction / PERCENT,
        "whole": [_WHOLE.start, _WHOLE.stop],
        "fit": fit,
        "loops": loops,
        "force_n": {f"{p / PA_PER_BAR:g} bar": force for p, force in forces.items()},
        "static_n": {f"{p / PA_PER_BAR:g} bar": p * area * fit for p in forces},
        "off_percent": max(each["off_percent"] for each in loops.values()),
        "pressure_spread_percent": 100.0 * float(np.max(spread)),
    }


def _tension(fibres: int, pressure: float, contraction: FloatArray) -> FloatArray:
    share = {"hysteresis.force_share": value(f"delta_{fibres}")}
    rig = bench("vandamme2008").with_parameters(share)
    time = np.arange(contraction.size, dtype=np.float64) * _PERIOD
    return stretched(rig, time, contraction, pressure).tension


def _width(error: FloatArray) -> float:
    """Widest distance of the branches of the whole loop, falling and rising in contraction."""
    whole = error[_WHOLE]
    half = len(whole) // 2
    return float(np.max(np.abs(whole[: half + 1] - whole[half:][::-1])))
