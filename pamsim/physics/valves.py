"""A pair of valves per muscle, one to supply and one to exhaust, and the ways to drive it.

The pair is driven by a signed opening u in [-1, 1]: +1 fully open to supply, -1 fully open to
exhaust, 0 shut. The command is that opening itself, a duty that pulses on/off valves, or a pressure
set point that a local regulator turns into an opening.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import ClassVar

from pamsim.core.parameters import ParameterGroup, parameter

COMMANDS: tuple[str, ...] = ("valve", "pulse", "pressure_set", "measured")
"""What the control of the actuator means: a signed opening, a signed duty, the set point of a
regulator, or the gauge pressure that the chamber has after the time step, whatever valves and air
would do."""

VALVE, PULSE, PRESSURE_SET, MEASURED = (float(code) for code in range(len(COMMANDS)))
"""Their codes in the slot ``command`` of the parameter row."""

WIDEST_DEAD_ZONE = 0.9
"""Opening up to which a valve may stay shut at most [-]."""

_optional = functools.partial(parameter, low=0.0, default=0.0)
"""Parameter that is 0 where a muscle has nothing of the kind."""


@dataclass(frozen=True, kw_only=True)
class ValvePair(ParameterGroup):
    """Fill and exhaust valve of one muscle, with the supply behind them."""

    group: ClassVar[str] = "valve"
    conductance_fill: float = parameter(
        unit="m^3/(s*Pa)", low=0.0, high=1e-6, doc="sonic conductance C to the supply"
    )
    conductance_exhaust: float = parameter(
        unit="m^3/(s*Pa)", low=0.0, high=1e-6, doc="sonic conductance C to the exhaust"
    )
    critical_ratio: float = parameter(unit="1", low=0.0, high=0.9, doc="critical pressure ratio b")
    laminar_ratio: float = parameter(
        unit="1", low=0.95, high=0.9999, doc="ratio above which flow is linear", default=0.999
    )
    supply_pressure: float = parameter(
        unit="Pa", low=0.0, high=2e6, doc="gauge pressure of the supply"
    )
    pulse_period: float = parameter(
        unit="s", low=1e-4, high=1.0, doc="period of pulse-width modulation", default=0.02
    )
    regulator_band: float = parameter(
        unit="Pa",
        low=1.0,
        high=1e6,
        doc="pressure error at which the set-point regulator opens a valve fully",
        default=1e4,
    )
    regulator_dead_band: float = _optional(
        unit="Pa", high=1e5, doc="error the regulator leaves alone"
    )
    dead_zone: float = _optional(
        unit="1", high=WIDEST_DEAD_ZONE, doc="opening up to which a valve stays shut, mean of both"
    )
    dead_zone_asymmetry: float = parameter(
        unit="1",
        low=-1.0,
        high=1.0,
        doc="a: fill valve shut up to 1 + a times the dead zone, exhaust valve up to 1 - a times",
        default=0.0,
    )
    supply_resistance: float = _optional(
        unit="Pa*s/kg",
        high=1e11,
        doc="fall of the supply's pressure per mass flow drawn by all its muscles",
    )
    supply_square: float = _optional(
        unit="Pa*s^2/kg^2",
        high=1e16,
        doc="fall of the supply's pressure per square of that flow, as in fittings and regulators",
    )
    supply_volume: float = _optional(
        unit="m^3", high=1.0, doc="volume of air between the supply's resistance and the valves"
    )
    supply_line: float = _optional(
        unit="1", high=1e3, doc="number of the supply: muscles that state the same one share it"
    )
    line_lag: float = _optional(unit="s", high=10.0, doc="time constant from command to valve")
    line_slew_time: float = _optional(
        unit="s",
        high=10.0,
        doc="in which the command's line moves by 1 bar or a full opening at its limited rate",
    )
    travel_time: float = _optional(
        unit="s",
        high=10.0,
        doc="in which a valve goes from shut to fully open at its limited speed",
    )
    tube_resistance: float = _optional(
        unit="Pa*s/kg",
        high=1e11,
        doc="R, pressure difference per mass flow along the line from valves and sensor to muscle",
    )
    tube_volume: float = parameter(
        unit="m^3",
        low=1e-6,
        high=1e-2,
        doc="V of the tube at the valves, in addition to the dead volume; limits the time step",
        default=5e-6,
    )
    delay: float = _optional(unit="s", high=1.0, doc="dead time of the command; in simulate only")


def clamped_opening(command: float) -> float:
    """Signed opening limited to [-1, 1]; NaN stays NaN. The engine hands on the raw control."""
    if command > 1.0:
        return 1.0
    if command < -1.0:
        return -1.0
    return command


def past_dead_zone(valve: ValvePair, opening: float) -> float:
    """What is left of a signed opening behind the overlap that shuts a valve around zero.

    The rest is stretched to the full range: the flow sets in without a jump, on which a regulator
    would chatter, and the conductance stays that of the fully open valve. On/off valves, which open
    fully or not at all, do not notice.

    Args:
        valve: its dead zone z and asymmetry a count: the fill valve stays shut up to z (1 + a), the
            exhaust valve up to z (1 - a), neither beyond 0.9.
        opening: in [-1, 1].

    Returns:
        Opening in [-1, 1]; exactly the given one without a dead zone. NaN stays NaN.
    """
    if valve.dead_zone == 0.0:
        return opening
    share = 1.0 + math.copysign(1.0, opening) * valve.dead_zone_asymmetry
    zone = min(valve.dead_zone * share, WIDEST_DEAD_ZONE)
    if abs(opening) > zone:
        return math.copysign((abs(opening) - zone) / (1.0 - zone), opening)
    return 0.0 * opening  # not a plain 0: a NaN opening must not shut the valve silently
