"""Van Damme 2008 on the bench: tensile loops at constant pressure with the Preisach factor."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any

import numpy as np

from pamsim.core.units import PA_PER_BAR, FloatArray
from pamsim.papers.bench_experiments import bench, stretched
from pamsim.papers.vandamme2008.numbers import PERCENT, largest, length, pressures, value
from pamsim.papers.vandamme2008.relays import (
    RelaySum,
    line_slope,
    printed_weight,
    relay_weights,
)
from pamsim.physics.force_laws.pleated import SLENDERNESS_6, pleated_function

_SPEED = 0.25
"""Of the loops, contraction per second [1/s]: they do not depend on it."""
_PERIOD = 0.01  # between two samples [s]
_TURNS = (0.05, 0.35, 0.05, 0.35, 0.07, 0.20, 0.07)
"""Contractions at which the machine turns: a whole loop, then one inside it [-]."""
_WHOLE = slice(120, 361)
"""Samples of the whole loop: from the first 35 % to the second."""
_LEVELS = 80
"""Of the grid in the bench's params.toml."""
_FIBRES = (40, 25)
_ONE = 1.5 * PA_PER_BAR
"""Pressure of Figures 9 and 10 [Pa]."""


def bench_curves() -> Mapping[str, Any]:
    """Loops of the engine beside (7), relay by relay.

    Returns:
        ``contraction_percent`` (n,) [%]; ``fit`` (n,): (2) [-]; by number of fibres ``function``
        (n,): f_t0 of the engine at 1.5 bar [-], ``error_percent``: e by (4), ``law_percent``: e by
        (6), both [%], ``width_percent``: the widest distance of the branches of the whole loop,
        engine and (6); ``force_n``: pressure -> (n,) [N] with 25 fibres, and ``static_n``
        without memory; ``whole``: first and last sample of the whole loop; ``off_percent``:
        largest distance of e of the engine and (6); ``pressure_spread_percent``: that of e between
        the pressures.
    """
    time, contraction = _path()
    law = SLENDERNESS_6
    fit = np.array(
        [pleated_function(k, law.f0, law.f1, law.f2, law.f3, law.f4) for k in contraction.tolist()]
    )
    area = length() ** 2
    exact = _relative_output(contraction)
    loops: dict[str, Any] = {}
    for fibres in _FIBRES:
        function = _tension(fibres, _ONE, time, contraction) / (_ONE * area)
        error, by_law = 100.0 * (function / fit - 1.0), 100.0 * value(f"delta_{fibres}") * exact
        loops[str(fibres)] = {
            "function": function,
            "error_percent": error,
            "law_percent": by_law,
            "width_percent": {"engine": _width(error), "law": _width(by_law)},
            "off_percent": float(np.max(np.abs(error - by_law))),
        }
    forces = {p: _tension(25, p, time, contraction) for p in pressures()}
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


def _tension(fibres: int, pressure: float, time: FloatArray, contraction: FloatArray) -> FloatArray:
    """Tension of the engine along a path [N]."""
    rig = bench("vandamme2008").with_parameters(
        {"hysteresis.force_share": value(f"delta_{fibres}")}
    )
    return stretched(rig, time, contraction, pressure).tension


def _path() -> tuple[FloatArray, FloatArray]:
    """Times and contractions, with samples at the turning points."""
    legs = [
        np.linspace(start, end, round(abs(end - start) / (_SPEED * _PERIOD)) + 1)[1:]
        for start, end in itertools.pairwise(_TURNS)
    ]
    contraction: FloatArray = np.concatenate([_TURNS[:1], *legs])
    return np.arange(contraction.size, dtype=np.float64) * _PERIOD, contraction


def _relative_output(contraction: FloatArray) -> FloatArray:
    """W - W_fit along a path from a virgin muscle, every relay on its own [-]."""
    weights = relay_weights(_LEVELS, printed_weight)
    relays = RelaySum(weights)
    u = 2.0 * contraction / largest() - 1.0
    return np.array([relays.step(each) for each in u.tolist()]) - line_slope(weights) * u


def _width(error: FloatArray) -> float:
    """Widest distance of the branches of the whole loop, falling and rising in contraction."""
    whole = error[_WHOLE]
    half = len(whole) // 2
    return float(np.max(np.abs(whole[: half + 1] - whole[half:][::-1])))
