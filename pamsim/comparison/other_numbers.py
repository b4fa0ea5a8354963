"""How much a rig misses of trials if its own numbers may be others.

Most rigs are described before they are measured: lengths, stiffness and friction are off by tens of
per cent, valves and volumes by more. What such numbers explain is no mistake of a recording.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import scipy.optimize

from pamsim.core.errors import PamsimError
from pamsim.core.units import FloatArray
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig

# scipy carries no types: what it returns is Any at this file's boundary.
_least_squares: Any = scipy.optimize.least_squares

_FACTORS = {
    "force.scale": 2.0,
    "force.area": 2.0,
    "force.stiffness": 2.0,
    "passive.stiffness": 2.0,
    "chamber.dead_volume": 5.0,
    "valve.conductance_fill": 5.0,
    "valve.conductance_exhaust": 5.0,
}
"""Number of all muscles -> factor by which it may be off: twice where a data sheet or a scale
states it, five times where only a test would."""

_DAMPING = 5.0  # of a joint, likewise
_LENGTH = 0.05  # share of a muscle's nominal length by which its mounting may be off
_STEP, _TRIES = 0.02, 6  # of each range; more tries gain little that would decide
_BROKEN = 10.0  # times what the rig as described misses


def least_missed(rig: Rig, missed: Callable[[Rig], FloatArray | None]) -> float:
    """Sum of squares of what a rig misses with the numbers that make it least.

    It is infinite if the rig as described breaks down.

    Args:
        rig: as described.
        missed: rig -> (n,) what it misses, None where it breaks down.
    """
    first, numbers = missed(rig), list(_numbers(rig))
    if first is None:
        return np.inf

    def residual(place: FloatArray) -> FloatArray:
        values: dict[str, float] = {}
        for (names, end), at in zip(numbers, place - 1.0, strict=True):
            values |= {name: end(value, float(at)) for name, value in names.items()}
        try:
            found = missed(rig.with_parameters(values))
        except PamsimError:  # such as a muscle longer than its fibres
            found = None
        return _BROKEN * first if found is None else found

    # The rig as described is at 1, because scipy's steps are shares of the place.
    start = np.ones(len(numbers))
    best = _least_squares(
        residual, start, bounds=(start - 1.0, start + 1.0), diff_step=_STEP, max_nfev=_TRIES
    )
    return min(2.0 * float(best.cost), float(first @ first))


def _numbers(
    rig: Rig,
) -> Iterator[tuple[dict[str, float], Callable[[float, float], float]]]:
    """Parameters that change together with their values; value, place in [-1, 1] -> new value."""
    for name, most in _FACTORS.items():
        yield from _by_factor(rig, [f"{muscle}:{name}" for muscle in rig.muscles], most)
    for joint in rig.joints:
        yield from _by_factor(rig, [f"joint.{joint}.damping"], _DAMPING)
    for muscle, one in rig.muscles.items():
        reach = _LENGTH * (one.stroke or one.braided).nominal_length
        length = {f"{muscle}:mounting.length_at_zero": one.mounting.length_at_zero}
        yield length, lambda value, place, reach=reach: value + reach * place


def _by_factor(
    rig: Rig, names: list[str], most: float
) -> Iterator[tuple[dict[str, float], Callable[[float, float], float]]]:
    values: dict[str, float] = {}
    for name in names:
        with contextlib.suppress(PamsimError):  # the rig has none
            values[name] = rig_parameter(rig, name).value
    if any(values.values()):
        yield values, lambda value, place: value * most**place
