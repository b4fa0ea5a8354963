"""Polytropic air chamber of changing volume.

dP/dt = n (R T mdot - P dV/dt) / V. With the state y = P^(1/n) V this becomes
dy/dt = P^(1/n - 1) R T mdot, in which dV/dt has cancelled: with the valves shut y, and so P V^n, is
constant exactly, at any step size and under any motion. P follows from y and V algebraically.
For n = 1, y / (R T) is the mass of air.

All air flows at the temperature T. The energy of the air, P V / (g - 1) with g = 1.4, then changes
by the enthalpy of the flow, the work on the braid and the heat through the walls:

    d/dt P V / (g - 1) = g / (g - 1) R T mdot - P dV/dt + (g - n) / (g - 1) (P dV/dt - R T mdot)

The index states the last term: no heat for n = 1.4, and for n = 1 as much as keeps the air at T.

With heat exchange at a rate h as well, the pressure returns to that of the same air m at the
ambient temperature, dP/dt = ... - h (P - m R T / V): after a fast fill it falls, and after a fast
vent it rises, while the valves are shut. The air m R T [J] is then a second state.
"""

from __future__ import annotations

import math

from pamsim.core.parameters import ParameterGroup, quantity
from pamsim.physics.air import ATMOSPHERE, GAS_CONSTANT


class Chamber(ParameterGroup, group="chamber"):
    """The air in the muscle and in the tubing that is always open to it."""

    polytropic_index: float = quantity("[1, 1.4]", "n: 1 isothermal, 1.4 adiabatic")
    temperature: float = quantity("[200, 400] K", "temperature of the air")
    dead_volume: float = quantity("[0, 1e-2] m^3", "volume of fittings and tubing")
    atmosphere: float = quantity("[3e4, 1.2e5] Pa", "absolute ambient pressure", ATMOSPHERE)
    floor: float = quantity(
        "[1, 3e4] Pa", "absolute pressure below which the chamber is never evaluated", 1e3
    )
    heat_rate: float = quantity(
        "[0, 1e3] 1/s",
        "h, at which air that a change made warm or cold returns to the ambient temperature",
        0.0,
    )
    leak_conductance: float = quantity(
        "[0, 1e-8] m^3/(s*Pa)", "sonic conductance C of a leak to the atmosphere", 0.0
    )
    laminar_leak_conductance: float = quantity(
        "[0, 1e-8] m^3/(s*Pa)",
        "g of a narrow leak to the atmosphere: volume flow at its mean pressure per difference",
        0.0,
    )
    cross_leak_conductance: float = quantity(
        "[0, 1e-8] m^3/(s*Pa)",
        "g of a narrow leak to the muscle at the chain's other end; the mean of both counts",
        0.0,
    )


def absolute_pressure(chamber: Chamber, air: float, volume: float) -> float:
    """Absolute pressure P = (y / V)^n [Pa] of air y in a volume V > 0 [m^3], above the floor."""
    pressure = (air / volume) ** chamber.polytropic_index
    if pressure < chamber.floor:
        return chamber.floor
    return pressure


def air_state(chamber: Chamber, pressure_abs: float, volume: float) -> float:
    """State y = P^(1/n) V at P [Pa, absolute] and V [m^3]: the inverse of `absolute_pressure`."""
    return pressure_abs ** (1.0 / chamber.polytropic_index) * volume


def air_state_rate(chamber: Chamber, pressure_abs: float, mass_flow: float) -> float:
    """Rate dy/dt = P^(1/n - 1) R T mdot of the air state at P [Pa, absolute] and mdot [kg/s]."""
    per_air = pressure_abs ** (1.0 / chamber.polytropic_index - 1.0)
    return per_air * GAS_CONSTANT * chamber.temperature * mass_flow


def relaxing_rate(
    chamber: Chamber, air: float, pressure_abs: float, ambient_pressure: float, timestep: float
) -> float:
    """Part of dy/dt that heat exchange makes over an Euler step [s].

    In one step it takes P to where it is exactly, if nothing else changes. Of the air y, P and the
    pressure of the same air at the ambient temperature, m R T / V [Pa, absolute].
    """
    decay = math.exp(-chamber.heat_rate * timestep)
    after = ambient_pressure + (pressure_abs - ambient_pressure) * decay
    return air * ((after / pressure_abs) ** (1.0 / chamber.polytropic_index) - 1.0) / timestep
