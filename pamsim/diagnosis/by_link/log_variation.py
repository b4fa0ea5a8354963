"""What differs from log to log of one rig, where no repeats show it."""

from __future__ import annotations

import numpy as np

from pamsim.comparison.chain_runs import MIDDLE
from pamsim.comparison.chain_simulator import ChainSimulator
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray

VARYING = (
    "force.scale",
    "passive.stiffness",
    "valve.supply_pressure",
    "valve.conductance_fill",
    "valve.conductance_exhaust",
)
"""Parameters that change with temperature, seating of a muscle and supply."""

VARIATION = 0.01
"""Their relative standard deviation. It is an assumption, which a result states: one log does not
show it. What an effect does that is less than this changes is then not claimed."""


def log_variation(simulator: ChainSimulator) -> FloatArray:
    """Change of the residual with each parameter that varies, at its standard deviation, (N, k).

    Args:
        simulator: of the links.
    """
    sets: list[dict[str, float]] = []
    for name in VARYING:
        try:
            sets.append({name: (1.0 + VARIATION) * simulator.own_value(name)})
        except InputError:  # a bellows has no braid, a regulator no valve
            continue
    links = [simulator.acts_in(values) for values in sets]
    found = simulator.residuals(sets, links, simulator.stated, steps=MIDDLE)
    columns = [residual - simulator.stated for residual in found if residual is not None]
    return np.column_stack([np.empty((simulator.stated.size, 0)), *columns])
