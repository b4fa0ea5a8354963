"""Supply that several muscles share: a source behind a resistance, and the volume of the line.

The source's pressure P_0 is constant; that of the line, which the fill valves see, is lower by the
sag s. Air enters the line at a flow q and leaves it through the open valves (ISO 6358, see
`pamsim.physics.air`); its volume V, at constant temperature, stores the difference:

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
from pamsim.physics.air import GAS_CONSTANT, mass_flow
from pamsim.physics.muscle_valves import pressure_at_valve, reached_opening
from pamsim.physics.record import MutableRow, Parameters, States
from pamsim.physics.valves import flow_share

Valves: TypeAlias = Sequence[Sequence[float]] | FloatArray

VALVE = 6
"""Numbers that describe one fill valve: the absolute pressures of source and chamber [Pa], sonic
conductance as far as it is open [m^3/(s Pa)], critical ratio, laminar ratio and air temperature
[K]. They are the arguments of `mass_flow`."""

_TINY = 1e-300  # in the place of 0, where nothing flows
_PRECISION = 4e-15  # of the pressures, about their rounding


def sags(m: Parameters) -> bool:
    """Whether the supply's pressure falls with the flow drawn from it."""
    return m.valve.supply_resistance + m.valve.supply_square > 0.0


def fill_valve_of(
    m: Parameters,
    s: States,
    pressure_abs: float,
    command: float,
    time: float,
    timestep: float,
    valve: MutableRow,
) -> None:
    """Write what a muscle's fill valve means to its supply into a row of `VALVE` numbers.

    The absolute pressure [Pa] is that in the chamber, the command the one sent, before its line.
    """
    at_valve = pressure_at_valve(m, s, pressure_abs)
    opening = reached_opening(m, s, command, at_valve, time, timestep)
    left = flow_share(m.valve, opening)
    valve[0] = m.valve.supply_pressure + m.chamber.atmosphere
    valve[1] = at_valve
    valve[2] = 0.0 if left <= 0.0 else left * m.valve.conductance_fill
    valve[3] = m.valve.critical_ratio
    valve[4] = m.valve.laminar_ratio
    valve[5] = m.chamber.temperature


def supply_sag(m: Parameters, s: States, valves: Valves, timestep: float) -> float:
    """Fall of a muscle's supply at the end of a time step.

    Args:
        m: parameters of the muscle, with R or S of its supply above 0.
        s: its states; the sag at the start of the step has no influence without volume.
        valves: (m, VALVE) fill valves of all muscles on its supply, see `fill_valve_of`.
        timestep: [s].

    Returns:
        s [Pa], negative where a muscle fills the line; NaN if a valve's numbers are.
    """
    resistance, square = m.valve.supply_resistance, m.valve.supply_square
    before = (m.valve.supply_pressure + m.chamber.atmosphere) * s.sag
    # Mass flow per change of pressure over the step; 0 for a line without volume.
    storage = m.valve.supply_volume / (GAS_CONSTANT * m.chamber.temperature * timestep)
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
    below = _missing(m, low, valves, storage, kept) / slope
    above = _missing(m, high, valves, storage, kept) / slope
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
        excess = _missing(m, sag, valves, storage, kept) / slope
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


def _missing(m: Parameters, sag: float, valves: Valves, storage: float, kept: float) -> float:
    """Mass flow that source and storage give beyond what the valves pass [kg/s]."""
    drawn = 0.0
    for valve in valves:
        drawn += mass_flow(valve[0] - sag, valve[1], valve[2], valve[3], valve[4], valve[5])
    # The source gives q, the root of s = R q + S q |q|.
    resistance = m.valve.supply_resistance
    root = math.sqrt(resistance * resistance + 4.0 * m.valve.supply_square * abs(sag))
    given = 0.0
    if resistance + root > 0.0:
        given = 2.0 * sag / (resistance + root)
    return given + storage * sag - kept - drawn
