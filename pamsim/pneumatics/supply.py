"""Supply that several muscles share: a source behind a resistance, and the volume of the line.

The source's pressure P_0 is constant; that of the line, which the fill valves see, is lower by the
sag s. Air enters the line at s / R and leaves it through the open valves (ISO 6358, see
`pamsim.pneumatics.orifice`); its volume V, at constant temperature, stores the difference:

    V / (R_air T) ds/dt = w_1(P_0 - s) + w_2(P_0 - s) + ... - s / R

Over a time step the equation is solved for the sag at its end (implicit Euler), so a line of small
volume needs no short step, and without volume the sag follows the flow at once. The flows w fall as
s grows, so there is exactly one solution. All valves see it: what the line loses, muscles gain.

Air flows through an open valve in either direction. From a muscle at higher pressure it returns to
the line, from where it may fill another muscle.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from pamsim.pneumatics.orifice import mass_flow

Valves: TypeAlias = Sequence[Sequence[float]] | NDArray[np.float64]

VALVE = 6
"""Numbers that describe one fill valve, see `supply_sag`."""

_PRECISION = 4e-15  # of the pressures, about their rounding


def supply_sag(
    valves: Valves,
    resistance: float,
    storage: float,
    before: float,
) -> float:
    """Fall of a supply's pressure at the end of a time step.

    Args:
        valves: (m, VALVE) for each fill valve the absolute pressures of source and chamber [Pa],
            sonic conductance as far as it is open [m^3/(s Pa)], critical ratio, laminar ratio and
            air temperature [K].
        resistance: R > 0 from source to line [Pa s/kg].
        storage: V / (R_air T dt), mass flow per change of pressure over the step [kg/(s Pa)]; 0 for
            a line without volume.
        before: sag at the start of the step; of no influence without storage [Pa].

    Returns:
        s [Pa], negative where a muscle fills the line; NaN if a valve's numbers are.
    """
    given = 1.0 / resistance + storage
    idle = storage * before / given  # the sag with all valves shut
    low, high, enough = idle, idle, _PRECISION * abs(idle)
    for valve in valves:
        if valve[2] != 0.0:
            low = min(low, valve[0] - valve[1])
            high = max(high, valve[0] - valve[1])
            enough = max(enough, _PRECISION * valve[0], _PRECISION * valve[1])
    below = _excess(low, valves, given, idle)
    above = _excess(high, valves, given, idle)
    if math.isnan(below + above):
        return math.nan
    if below >= 0.0:
        return low
    if above <= 0.0:
        return high
    # Illinois method. The excess rises at least as fast as the sag, so that it bounds the error.
    sag, side = idle, 0
    while high - low > enough:
        sag = high - above * (high - low) / (above - below)
        if not low < sag < high:
            sag = 0.5 * (low + high)
        excess = _excess(sag, valves, given, idle)
        if abs(excess) <= enough:
            break
        if excess > 0.0:
            high, above = sag, excess
            if side > 0:
                below *= 0.5
            side = 1
        else:
            low, below = sag, excess
            if side < 0:
                above *= 0.5
            side = -1
    return sag


def _excess(
    sag: float,
    valves: Valves,
    given: float,
    idle: float,
) -> float:
    """Sag beyond that at which source and storage give what the valves pass [Pa]."""
    drawn = 0.0
    for valve in valves:
        drawn += mass_flow(valve[0] - sag, valve[1], valve[2], valve[3], valve[4], valve[5])
    return sag - idle - drawn / given
