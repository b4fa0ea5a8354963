"""Laminar flow of a gas through a narrow gap or capillary, as of a slow leak.

A volume flow g (p1 - p2) at the local pressure passes every section in proportion to its pressure
gradient (Poiseuille). The mass that passes is the same in all of them, so the density in between
counts with its mean, and the mass flow goes with the difference of the squares:

    mdot = g (p1^2 - p2^2) / (2 R_air T)

For a capillary of radius r and length l, g = pi r^4 / (8 eta l). Leak rates of viscous flow are
converted between pressures by the same law (EN 1779).
"""

from __future__ import annotations

from pamsim.physics.air import GAS_CONSTANT


def laminar_flow(
    pressure_from: float, pressure_to: float, conductance: float, temperature: float
) -> float:
    """Mass flow from one side of a narrow gap to the other.

    Args:
        pressure_from: absolute pressure on the first side [Pa].
        pressure_to: absolute pressure on the second side [Pa].
        conductance: g, volume flow at the mean pressure per pressure difference [m^3/(s Pa)].
        temperature: T of the air [K].

    Returns:
        mdot [kg/s], positive from the first side to the second, and odd under swapping them.
    """
    mean_density = 0.5 * (pressure_from + pressure_to) / (GAS_CONSTANT * temperature)
    return conductance * mean_density * (pressure_from - pressure_to)
