"""Rates at which the valves change a muscle's pressure, and the lag of a regulated pressure.

dP/dt = n R T mdot / V at full opening; inside the regulator's band the opening is the error over
the band, so that the pressure follows its set point as a lag does.
"""

from __future__ import annotations

from pamsim.physics.air import GAS_CONSTANT
from pamsim.physics.layout import Row, slot
from pamsim.physics.muscle_valves import air_flow, fill_valve, sags
from pamsim.physics.static_muscle import static_volume
from pamsim.physics.supply import VALVE, supply_sag

_POLYTROPIC = slot("chamber.polytropic_index")
_TEMPERATURE = slot("chamber.temperature")
_ATMOSPHERE = slot("chamber.atmosphere")
_COMMAND = slot("command")
_RESISTANCE = slot("valve.supply_resistance")
_SQUARE = slot("valve.supply_square")
_BAND = slot("valve.regulator_band")


def full_rates(par: Row, tendon_length: float, pressure: float) -> tuple[float, float]:
    """Rates of pressure with the fill and with the exhaust valve fully open [Pa/s].

    The supply sags by the flow to this muscle alone.

    Args:
        par: parameter row of the muscle.
        tendon_length: held [m].
        pressure: gauge [Pa].
    """
    row = list(par)
    row[_COMMAND] = 0.0  # a signed opening
    absolute = pressure + row[_ATMOSPHERE]
    inside = static_volume(row, tendon_length, pressure)
    scale = row[_POLYTROPIC] * GAS_CONSTANT * row[_TEMPERATURE] / inside
    sag, valve = 0.0, [0.0] * VALVE
    if sags(row):
        fill_valve(row, absolute, 1.0, valve)
        sag = supply_sag([valve], row[_RESISTANCE], row[_SQUARE], 0.0, 0.0)
    fill = air_flow(row, absolute, 1.0, 0.0, sag)
    return scale * fill, scale * air_flow(row, absolute, -1.0, 0.0)


def regulated_lag(par: Row, tendon_length: float, pressure: float) -> float:
    """Time constant of a regulated pressure, mean of filling and venting [s].

    Args:
        par: parameter row of the muscle.
        tendon_length: held [m].
        pressure: gauge [Pa].
    """
    fill, exhaust = full_rates(par, tendon_length, pressure)
    return 0.5 * par[_BAND] * (1.0 / fill - 1.0 / exhaust)
