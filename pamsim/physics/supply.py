"""Supply that several muscles share: a source behind a resistance, and the volume of the line.

The source's pressure P_0 is constant; that of the line, which the fill valves see, is lower by the
sag s. Air enters the line at a flow q and leaves it through the open valves (ISO 6358, see
`pamsim.physics.orifice`); its volume V, at constant temperature, stores the difference:

    V / (R_air T) ds/dt = w_1(P_0 - s) + w_2(P_0 - s) + ... - q,    s = R q + S q |q|

The fall is proportional to the flow in narrow lines (R) and to its square in fittings and
regulators (S).

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

from pamsim.core.units import FloatArray
from pamsim.physics.orifice import mass_flow

Valves: TypeAlias = Sequence[Sequence[float]] | FloatArray

VALVE = 6
"""Numbers that describe one fill valve, see `supply_sag`."""

_TINY = 1e-300  # in the place of 0, where nothing flows
_PRECISION = 4e-15  # of the pressures, about their rounding


def supply_sag(
    valves: Valves,
    resistance: float,
    square: float,
    storage: float,
    before: float,
) -> float:
    """Fall of a supply's pressure at the end of a time step.

    Args:
        valves: (m, VALVE) for each fill valve the absolute pressures of source and chamber [Pa],
            sonic conductance as far as it is open [m^3/(s Pa)], critical ratio, laminar ratio and
            air temperature [K].
        resistance: R from source to line [Pa s/kg].
        square: S, which or R must be above 0 [Pa s^2/kg^2].
        storage: V / (R_air T dt), mass flow per change of pressure over the step [kg/(s Pa)]; 0 for
            a line without volume.
        before: sag at the start of the step; of no influence without storage [Pa].

    Returns:
        s [Pa], negative where a muscle fills the line; NaN if a valve's numbers are.
    """
    kept = storage * before
    if square == 0.0:
        idle = kept / (1.0 / resistance + storage)  # the sag with all valves shut
        low, high = idle, idle
    else:  # it lies between that before and 0
        idle = before if storage > 0.0 else 0.0
        low, high = min(idle, 0.0), max(idle, 0.0)
    enough = _PRECISION * abs(idle)
    for valve in valves:
        if valve[2] != 0.0:
            low = min(low, valve[0] - valve[1])
            high = max(high, valve[0] - valve[1])
            enough = max(enough, _PRECISION * valve[0], _PRECISION * valve[1])
    # Least slope of what source and storage give, at the largest sag.
    steepest = max(resistance * resistance + 4.0 * square * max(-low, high), _TINY)
    slope = 1.0 / math.sqrt(steepest) + storage
    below = _missing(low, valves, resistance, square, storage, kept) / slope
    above = _missing(high, valves, resistance, square, storage, kept) / slope
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
        excess = _missing(sag, valves, resistance, square, storage, kept) / slope
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


def _missing(
    sag: float,
    valves: Valves,
    resistance: float,
    square: float,
    storage: float,
    kept: float,
) -> float:
    """Mass flow that source and storage give beyond what the valves pass [kg/s]."""
    drawn = 0.0
    for valve in valves:
        drawn += mass_flow(valve[0] - sag, valve[1], valve[2], valve[3], valve[4], valve[5])
    return source_flow(sag, resistance, square) + storage * sag - kept - drawn


def source_flow(sag: float, resistance: float, square: float) -> float:
    """Mass flow q through a source [kg/s], the root of s = R q + S q |q|.

    Args:
        sag: s, the fall of the pressure [Pa].
        resistance: R [Pa s/kg].
        square: S [Pa s^2/kg^2].
    """
    if square == 0.0:
        return sag / resistance
    root = resistance + math.sqrt(resistance * resistance + 4.0 * square * abs(sag))
    return 2.0 * sag / root if root > 0.0 else 0.0
