"""Safe experiments beyond those at hand, from which a diagnosis chooses the next."""

from __future__ import annotations

import numpy as np

from pamsim.comparison.protocols import PROTOCOLS, Protocol
from pamsim.core.units import FloatArray

_FILLING = 0.6  # time for which a valve is opened before it shuts [s]


def _shut_hold(time: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Muscle 1 filled, muscle 2 left; then both shut."""
    opening = np.where(time < _FILLING, 0.3, 0.0)
    return np.stack([opening, 0.3 * opening], axis=1)


def _small_reversals(time: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Slow turns that grow from nothing, at a low common pressure."""
    half = 5e3 * (1.0 + time) * np.sin(2.0 * np.pi * 0.5 * time)
    return np.maximum(np.stack([1.2e5 + half, 1.2e5 - half], axis=1), 0.0)


def _pressure_ladder(time: FloatArray, rng: np.random.Generator) -> FloatArray:
    """The same small turn at three common pressures."""
    common = np.select([time < 2.7, time < 5.4], [1.2e5, 2.5e5], 3.8e5)
    half = 4e4 * np.sin(2.0 * np.pi * time / 1.35)
    return np.stack([common + half, common - half], axis=1)


def _long_hold(time: FloatArray, rng: np.random.Generator) -> FloatArray:
    """One step, then set points held to the end."""
    half = np.where(time < 0.5, 0.0, 1.5e5)
    return np.stack([2.5e5 + half, 2.5e5 - half], axis=1)


MENU: dict[str, Protocol] = {
    protocol.name: protocol
    for protocol in (
        *PROTOCOLS.values(),
        Protocol(
            name="shut_hold",
            shows="what leaves a chamber whose valves are shut",
            command="valve",
            drive=_shut_hold,
        ),
        Protocol(
            name="small_reversals",
            shows="backlash, dry friction and dead zones: turns that grow from nothing",
            command="pressure_set",
            drive=_small_reversals,
        ),
        Protocol(
            name="pressure_ladder",
            shows="what grows with pressure: equal turns at three common pressures",
            command="pressure_set",
            drive=_pressure_ladder,
        ),
        Protocol(
            name="long_hold",
            shows="creep and drift: one step, then hold",
            command="pressure_set",
            drive=_long_hold,
        ),
        Protocol(
            name="long_hold_loaded",
            shows="what depends on the load: one step with a mass on the arm, then hold",
            command="pressure_set",
            drive=_long_hold,
            load=2.4,
        ),
    )
}
"""Name -> experiment. Those of `pamsim.comparison.protocols` vary with the seed."""
