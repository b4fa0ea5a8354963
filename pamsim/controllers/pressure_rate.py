"""Rates at which the valves change a muscle's pressure, and the lag of a regulated pressure.

dP/dt = n R T mdot / V at full opening; inside the regulator's band the opening is the error over
the band, so that the pressure follows its set point as a lag does.
"""

from __future__ import annotations

import copy

from pamsim.physics import commands
from pamsim.physics.air import GAS_CONSTANT
from pamsim.physics.muscle_valves import air_flow, fill_valve, sags
from pamsim.physics.record import Parameters
from pamsim.physics.static_muscle import static_volume
from pamsim.physics.supply import VALVE, supply_sag


def full_rates(m: Parameters, tendon_length: float, pressure: float) -> tuple[float, float]:
    """Rates of pressure with the fill and with the exhaust valve fully open [Pa/s].

    The supply sags by the flow to this muscle alone.

    Args:
        m: parameters of the muscle.
        tendon_length: held [m].
        pressure: gauge [Pa].
    """
    m = copy.copy(m)
    m.command = commands.VALVE
    absolute = pressure + m.chamber.atmosphere
    inside = static_volume(m, tendon_length, pressure)
    scale = m.chamber.polytropic_index * GAS_CONSTANT * m.chamber.temperature / inside
    sag, valve = 0.0, [0.0] * VALVE
    if sags(m):
        fill_valve(m, absolute, 1.0, valve)
        sag = supply_sag([valve], m.valve.supply_resistance, m.valve.supply_square, 0.0, 0.0)
    fill = air_flow(m, absolute, 1.0, 0.0, sag)
    return scale * fill, scale * air_flow(m, absolute, -1.0, 0.0)


def regulated_lag(m: Parameters, tendon_length: float, pressure: float) -> float:
    """Time constant of a regulated pressure, mean of filling and venting [s].

    Args:
        m: parameters of the muscle.
        tendon_length: held [m].
        pressure: gauge [Pa].
    """
    fill, exhaust = full_rates(m, tendon_length, pressure)
    return 0.5 * m.valve.regulator_band * (1.0 / fill - 1.0 / exhaust)
