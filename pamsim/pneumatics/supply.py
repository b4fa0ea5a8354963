"""Supply that several muscles share: a source behind a resistance, and the volume of the line.

The source's pressure P_0 is constant; that of the line, which the fill valves see, is lower by the
sag s. Air enters the line at s / R and leaves it through the open valves (ISO 6358, see
`pamsim.pneumatics.orifice`); its volume V, at constant temperature, stores the difference:

    V / (R_air T) ds/dt = w_1(P_0 - s) + w_2(P_0 - s) + ... - s / R

Narrow lines resist so. In fittings and regulators the fall grows with the square of the flow q.
With a share t of such turbulence at q_0 = 0.2 g/s, the flow at which R is stated, it is

    s = R q ((1 - t) + t |q| / q_0)

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

STATED_AT = 2e-4
"""Mass flow at which a turbulent supply's resistance is stated [kg/s]: it fills a MAS-20 muscle of
0.1 litres to 2 bar in about a second."""

_TINY = 1e-300  # in the place of 0, where nothing flows
_PRECISION = 4e-15  # of the pressures, about their rounding


def supply_sag(
    valves: Valves,
    resistance: float,
    storage: float,
    before: float,
    turbulence: float = 0.0,
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
        turbulence: share t of the fall that grows with the square of the flow, at `STATED_AT` [-].

    Returns:
        s [Pa], negative where a muscle fills the line; NaN if a valve's numbers are.
    """
    kept = storage * before
    # The sag with all valves shut. From a turbulent source it lies between this and 0.
    idle = kept / (1.0 / resistance + storage)
    low, high, enough = idle, idle, _PRECISION * abs(idle)
    if turbulence > 0.0 and storage > 0.0:
        low, high = min(before, 0.0), max(before, 0.0)
    for valve in valves:
        if valve[2] != 0.0:
            low = min(low, valve[0] - valve[1])
            high = max(high, valve[0] - valve[1])
            enough = max(enough, _PRECISION * valve[0], _PRECISION * valve[1])
    narrow, square = (1.0 - turbulence) * resistance, turbulence * resistance / STATED_AT
    # Least slope of what source and storage give, at the largest sag.
    steepest = max(narrow * narrow + 4.0 * square * max(-low, high), _TINY)
    slope = 1.0 / math.sqrt(steepest) + storage
    below = _missing(low, valves, narrow, square, storage, kept) / slope
    above = _missing(high, valves, narrow, square, storage, kept) / slope
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
            if not low < sag < high:  # no number is left between them
                break
        excess = _missing(sag, valves, narrow, square, storage, kept) / slope
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
    narrow: float,
    square: float,
    storage: float,
    kept: float,
) -> float:
    """Mass flow that source and storage give beyond what the valves pass [kg/s]."""
    drawn = 0.0
    for valve in valves:
        drawn += mass_flow(valve[0] - sag, valve[1], valve[2], valve[3], valve[4], valve[5])
    return source_flow(sag, narrow, square) + storage * sag - kept - drawn


def source_flow(sag: float, narrow: float, square: float) -> float:
    """Mass flow through a source whose pressure has fallen, the root of narrow q + square q |q|.

    Args:
        sag: fall of the pressure [Pa].
        narrow: fall per flow [Pa s/kg].
        square: fall per square of the flow [Pa s^2/kg^2].
    """
    if square == 0.0:
        return sag / narrow
    root = narrow + math.sqrt(narrow * narrow + 4.0 * square * abs(sag))
    return 2.0 * sag / root if root > 0.0 else 0.0
