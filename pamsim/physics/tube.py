"""Air line between the valves and the muscle: a small volume, then a resistance to the flow.

The valves and the pressure sensor sit at the near end. The air there, of volume V at constant
temperature T, has the pressure p; it flows on into the muscle at the pressure P in proportion to
the difference, as laminar flow does at a mean density that varies little:

    V / (R_air T) dp/dt = w - (p - P) / R

with the flow w of the valves. For constant w and P the step is solved exactly, so that a line of
little volume needs no short step on its own account.
"""

from __future__ import annotations

import math

from pamsim.physics.air import GAS_CONSTANT


def near_end_pressure(
    before: float,
    chamber_abs: float,
    inflow: float,
    resistance: float,
    volume: float,
    temperature: float,
    timestep: float,
) -> float:
    """Pressure at the near end of the line after a time step.

    Args:
        before: p before it [Pa, absolute].
        chamber_abs: P in the muscle during it [Pa, absolute].
        inflow: w from the valves during it [kg/s].
        resistance: R > 0 [Pa s/kg].
        volume: V > 0 [m^3].
        temperature: T of the air [K].
        timestep: [s].

    Returns:
        p [Pa, absolute].
    """
    level = chamber_abs + resistance * inflow
    emptying = resistance * volume / (GAS_CONSTANT * temperature)
    return before + (level - before) * -math.expm1(-timestep / emptying)


def line_outflow(
    inflow: float, rise: float, volume: float, temperature: float, timestep: float
) -> float:
    """Mean flow out of the line into the muscle over a time step [kg/s]: no air is lost.

    Args:
        inflow: w from the valves during it [kg/s].
        rise: of the pressure at the near end in it [Pa].
        volume: V [m^3].
        temperature: T [K].
        timestep: [s].
    """
    return inflow - volume * rise / (GAS_CONSTANT * temperature * timestep)
