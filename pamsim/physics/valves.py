"""A pair of valves per muscle, one to supply and one to exhaust, and the ways to drive it.

The pair is driven by a signed opening u in [-1, 1]: +1 fully open to supply, -1 fully open to
exhaust, 0 shut. The command is that opening itself, a duty that pulses on/off valves, or a pressure
set point that a local regulator turns into an opening.
"""

from __future__ import annotations

import math

from pamsim.core.parameters import ParameterGroup, quantity
from pamsim.physics.spline import curve_of_8

COMMANDS: tuple[str, ...] = ("valve", "pulse", "pressure_set", "measured")
"""What the control of the actuator means: a signed opening, a signed duty, the set point of a
regulator, or the gauge pressure that the chamber has after the time step, whatever valves and air
would do."""

VALVE, PULSE, PRESSURE_SET, MEASURED = (float(code) for code in range(len(COMMANDS)))
"""Their codes in the slot ``command`` of the parameter row."""

WIDEST_DEAD_ZONE = 0.9
"""Opening up to which a valve may stay shut at most [-]."""

CONTROLS = 8
"""Control values of a learned change of the flow: bends in a seventh of the openings."""


class ValvePair(ParameterGroup, group="valve"):
    """Fill and exhaust valve of one muscle, with the supply behind them."""

    conductance_fill: float = quantity("[0, 1e-6] m^3/(s*Pa)", "sonic conductance C to the supply")
    conductance_exhaust: float = quantity(
        "[0, 1e-6] m^3/(s*Pa)", "sonic conductance C to the exhaust"
    )
    critical_ratio: float = quantity("[0, 0.9]", "critical pressure ratio b")
    laminar_ratio: float = quantity("[0.95, 0.9999]", "ratio above which flow is linear", 0.999)
    supply_pressure: float = quantity("[0, 2e6] Pa", "gauge pressure of the supply")
    pulse_period: float = quantity("[1e-4, 1] s", "period of pulse-width modulation", 0.02)
    regulator_band: float = quantity(
        "[1, 1e6] Pa", "pressure error at which the set-point regulator opens a valve fully", 1e4
    )
    regulator_dead_band: float = quantity("[0, 1e5] Pa", "error the regulator leaves alone", 0.0)
    least_set_point: float = quantity(
        "[0, 1e6] Pa", "set point that the regulator keeps to where a lower one is sent", 0.0
    )
    dead_zone: float = quantity(
        f"[0, {WIDEST_DEAD_ZONE}]", "opening up to which a valve stays shut, mean of both", 0.0
    )
    dead_zone_asymmetry: float = quantity(
        "[-1, 1]",
        "a: fill valve shut up to 1 + a times the dead zone, exhaust valve up to 1 - a times",
        0.0,
    )
    supply_resistance: float = quantity(
        "[0, 1e11] Pa*s/kg",
        "fall of the supply's pressure per mass flow drawn by all its muscles",
        0.0,
    )
    supply_square: float = quantity(
        "[0, 1e16] Pa*s^2/kg^2",
        "fall of the supply's pressure per square of that flow, as in fittings and regulators",
        0.0,
    )
    supply_volume: float = quantity(
        "[0, 1] m^3", "volume of air between the supply's resistance and the valves", 0.0
    )
    supply_line: float = quantity(
        "[0, 1e3]", "number of the supply: muscles that state the same one share it", 0.0
    )
    line_lag: float = quantity("[0, 10] s", "time constant from command to valve", 0.0)
    line_slew_time: float = quantity(
        "[0, 10] s",
        "in which the command's line moves by 1 bar or a full opening at its limited rate",
        0.0,
    )
    travel_time: float = quantity(
        "[0, 10] s", "in which a valve goes from shut to fully open at its limited speed", 0.0
    )
    hysteresis: float = quantity(
        "[0, 1]",
        "change of the command at a reversal before a proportional valve follows it, as an opening",
        0.0,
    )
    tube_resistance: float = quantity(
        "[0, 1e11] Pa*s/kg",
        "R, pressure difference per mass flow along the line from valves and sensor to muscle",
        0.0,
    )
    tube_friction: float = quantity(
        "[0, 1e15] 1/m^4",
        "K, pressure difference along that line times the air's density per mass flow squared,"
        " turbulent; f L/(2 D A^2) of Darcy's friction factor f, length, diameter and section",
        0.0,
    )
    tube_volume: float = quantity(
        "[1e-6, 1e-2] m^3",
        "V of the tube at the valves, in addition to the dead volume; limits the time step",
        5e-6,
    )
    learned_low: float = quantity("[-1, 1]", "signed opening at which a curve begins", 0.0)
    learned_high: float = quantity("[-1, 1]", "signed opening at which it ends", 0.0)
    learned_1: float = quantity(
        "[-50, 50]", "control value of the flow's relative change over the opening, first", 0.0
    )
    learned_2: float = quantity("[-50, 50]", "second", 0.0)
    learned_3: float = quantity("[-50, 50]", "third", 0.0)
    learned_4: float = quantity("[-50, 50]", "fourth", 0.0)
    learned_5: float = quantity("[-50, 50]", "fifth", 0.0)
    learned_6: float = quantity("[-50, 50]", "sixth", 0.0)
    learned_7: float = quantity("[-50, 50]", "seventh", 0.0)
    learned_8: float = quantity("[-50, 50]", "eighth", 0.0)
    delay: float = quantity("[0, 1] s", "dead time of the command; in simulate only", 0.0)
    closing_delay: float = quantity(
        "[0, 1] s",
        "by which a smaller opening that is commanded arrives later still: an on/off valve stays"
        " open for longer than its pulse; not those of a duty, and in simulate only",
        0.0,
    )


def has_tube(valve: ValvePair) -> bool:
    """Whether the line between valves and muscle takes pressure from the air that flows in it."""
    return valve.tube_resistance + valve.tube_friction > 0.0


def clamped_opening(command: float) -> float:
    """Signed opening limited to [-1, 1]; NaN stays NaN. The engine hands on the raw control."""
    if command > 1.0:
        return 1.0
    if command < -1.0:
        return -1.0
    return command


def past_dead_zone(valve: ValvePair, opening: float) -> float:
    """What is left of an opening in [-1, 1] behind the overlap that shuts a valve around zero.

    The fill valve stays shut up to z (1 + a), the exhaust valve up to z (1 - a), with the dead zone
    z and its asymmetry a, neither beyond 0.9. The rest is stretched to the full range: the flow
    sets in without a jump, on which a regulator would chatter. NaN stays NaN.
    """
    if valve.dead_zone == 0.0:
        return opening
    share = 1.0 + math.copysign(1.0, opening) * valve.dead_zone_asymmetry
    zone = min(valve.dead_zone * share, WIDEST_DEAD_ZONE)
    if abs(opening) > zone:
        return math.copysign((abs(opening) - zone) / (1.0 - zone), opening)
    return 0.0 * opening  # not a plain 0: a NaN opening must not shut the valve silently


def learns_flow(valve: ValvePair) -> bool:
    """Whether a curve changes the flow."""
    return valve.learned_high > valve.learned_low


def flow_share(valve: ValvePair, opening: float) -> float:
    """Signed share of a valve's conductance at a signed opening in [-1, 1] [-].

    It is what the dead zone leaves of the opening, and may be larger than 1 where a learned curve
    f changes the flow by 1 + f, never below 0: f runs over the opening from exhaust to fill, so
    that each valve has a side of it, and they meet where nothing flows.
    """
    left = past_dead_zone(valve, opening)
    if learns_flow(valve):
        factor = 1.0 + curve_of_8(
            opening,
            valve.learned_low,
            valve.learned_high,
            valve.learned_1,
            valve.learned_2,
            valve.learned_3,
            valve.learned_4,
            valve.learned_5,
            valve.learned_6,
            valve.learned_7,
            valve.learned_8,
        )
        left *= 0.0 if factor < 0.0 else factor
    return left


def largest_factor(valve: ValvePair) -> float:
    """Largest factor of a learned curve on the flow [-], or 1: splines keep to control values."""
    if not learns_flow(valve):
        return 1.0
    return 1.0 + max(
        0.0,
        valve.learned_1,
        valve.learned_2,
        valve.learned_3,
        valve.learned_4,
        valve.learned_5,
        valve.learned_6,
        valve.learned_7,
        valve.learned_8,
    )
