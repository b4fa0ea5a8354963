"""Curves of the figures of Van Damme 2008: Preisach plane, major loop, force.

The paper fits its polynomial to measurements that it does not print: here the polynomial is the
least-squares fit to the exact shape for many fibres.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from pamsim.core.units import PA_PER_BAR, FloatArray
from pamsim.papers.vandamme2008.numbers import value
from pamsim.papers.vandamme2008.relays import (
    RelaySum,
    levels_of,
    line_slope,
    major_loop,
    printed_weight,
    relay_weights,
)
from pamsim.physics.force_laws.pleated import (
    FIT_RANGE,
    SLENDERNESS_6,
    pleated_function,
    pleated_max_contraction,
    pleated_shape_function,
)

_SLENDERNESS = 6.0  # l0/R, as printed
_MEMBRANE = 0.06  # l0 [m], as printed
_LARGEST = 0.35  # eps_max, as printed
_LEVELS = 80  # of the grid: twice as many moves no curve by more than a line's width
_HISTORY = (-1.0, 0.75, -0.55, 0.45, -0.2, 0.1)  # turning points that leave a staircase
_INNER = (0.20, 0.07)  # contractions between which the paper finds its model good


def pleated_curves() -> Mapping[str, Any]:
    """Plane, loops and force functions of Van Damme 2008.

    Returns:
        ``plane``: levels, weight over its largest value (n, n), and for every level the share of
        it that is up; ``major``: input, both branches and the straight line [-]; ``loops``: number
        of fibres -> contraction [%] and f_t0 [-], outer and inner; ``forces``: pressure ->
        contraction [%] and force [N]; ``exact``: contraction [%], exact and fitted f_t0 [-].
    """
    weights = relay_weights(_LEVELS, printed_weight)
    levels = levels_of(_LEVELS)
    rising, falling = major_loop(weights)
    slope = line_slope(weights)
    outer = _path((0.0, _LARGEST, 0.0))
    inner = _path((0.0, _LARGEST, _INNER[1], _INNER[0], _INNER[1]))
    outer_error, inner_error = _error(weights, outer, slope), _error(weights, inner, slope)
    # The way in from saturation is no part of the closed inner loop.
    closed = len(inner) - 2 * _steps(_INNER[0] - _INNER[1]) - 1
    inner, inner_error = inner[closed:], inner_error[closed:]
    valid = outer >= FIT_RANGE[0]
    deltas = {fibres: value(f"delta_{fibres}") for fibres in ("40", "25")}
    loops = {
        name: {
            "contraction_percent": 100.0 * outer[valid],
            "value": _polynomial(outer[valid]) * (1.0 + delta * outer_error[valid]),
            "inner_percent": 100.0 * inner,
            "inner_value": _polynomial(inner) * (1.0 + delta * inner_error),
        }
        for name, delta in deltas.items()
    }
    scale = _MEMBRANE * _MEMBRANE * PA_PER_BAR
    return {
        "plane": _plane(weights),
        "major": {
            "input": levels,
            "rising": rising,
            "falling": falling,
            "line": slope * levels,
        },
        "delta": deltas,
        "loops": loops,
        "static": {
            "contraction_percent": 100.0 * outer[valid],
            "value": _polynomial(outer[valid]),
        },
        "forces": {
            f"{bar:g} bar": {
                "contraction_percent": loops["25"]["contraction_percent"],
                "force_n": bar * scale * loops["25"]["value"],
            }
            for bar in (1.0, 1.5, 2.5)
        },
        "exact": _exact(),
    }


def _plane(weights: FloatArray) -> dict[str, Any]:
    plane = RelaySum(weights)
    for u in _HISTORY:
        plane.step(u)
    # Relays of the diagonal stand for half a cell: full height again, for the picture only.
    whole = weights * (1.0 + np.eye(len(weights)))
    return {
        "levels": levels_of(len(weights)),
        "weight": whole / whole.max(),
        "relays": plane.relays,
        "history": list(_HISTORY),
    }


def _error(weights: FloatArray, contraction: FloatArray, slope: float) -> FloatArray:
    """W - W_fit along a path of contractions that starts from lower saturation [-]."""
    operator = RelaySum(weights)
    operator.step(-1.1)
    scaled = 2.0 * contraction / _LARGEST - 1.0
    return np.array([operator.step(float(u)) for u in scaled]) - slope * scaled


def _steps(span: float) -> int:
    """Steps of a path over a span of contraction: one for every level of the grid."""
    return round(span / _LARGEST * _LEVELS)


def _path(turns: Iterable[float]) -> FloatArray:
    """Contractions in even steps from turn to turn [-]."""
    points = list(turns)
    legs = [
        np.linspace(start, end, _steps(abs(end - start)) + 1)[1:]
        for start, end in itertools.pairwise(points)
    ]
    return np.concatenate([points[:1], *legs])


def _polynomial(contraction: FloatArray) -> FloatArray:
    law = SLENDERNESS_6
    return np.array(
        [pleated_function(float(e), law.f0, law.f1, law.f2, law.f3, law.f4) for e in contraction]
    )


def _exact() -> dict[str, Any]:
    contraction = np.linspace(0.005, pleated_max_contraction(_SLENDERNESS), 200)
    return {
        "contraction_percent": 100.0 * contraction,
        "exact": np.array([pleated_shape_function(float(e), _SLENDERNESS) for e in contraction]),
        "polynomial": _polynomial(contraction),
        "range_percent": [100.0 * end for end in FIT_RANGE],
    }
