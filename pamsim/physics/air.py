"""Air: its constants, and its flow through an orifice.

The flow follows ISO 6358, with the sonic conductance C and the critical pressure ratio b.
"""

from __future__ import annotations

import math

GAS_CONSTANT = 287.05
"""Specific gas constant R of dry air [J/(kg K)] (ISO 2533)."""

ATMOSPHERE = 101325.0
"""Standard atmosphere [Pa, absolute] (ISO 2533)."""

REFERENCE_DENSITY = 1.185
"""Density of air at the reference atmosphere ANR of sonic conductance [kg/m^3] (ISO 8778)."""

REFERENCE_TEMPERATURE = 293.15
"""Its temperature [K]."""


def flow_function(ratio: float, critical_ratio: float, laminar_ratio: float) -> float:
    """Share of the choked flow that passes at a pressure ratio (ISO 6358-1:2013, 3.2 and annex).

    1 up to the critical ratio b of downstream over upstream absolute pressure, 0 at a ratio of 1,
    where the ellipse has infinite slope: above the laminar ratio the flow is linear in the pressure
    difference.
    """
    if ratio <= critical_ratio:
        return 1.0
    depth = (min(ratio, laminar_ratio) - critical_ratio) / (1.0 - critical_ratio)
    share = math.sqrt(1.0 - depth * depth)
    if ratio < laminar_ratio:
        return share
    return share * (1.0 - ratio) / (1.0 - laminar_ratio)


def mass_flow(
    pressure_from: float,
    pressure_to: float,
    conductance: float,
    critical_ratio: float,
    laminar_ratio: float,
    temperature: float,
) -> float:
    """Mass flow mdot [kg/s] from one side of an orifice to the other (ISO 6358).

    Odd under swapping the sides. The arguments are the absolute pressures on both sides [Pa], the
    sonic conductance C [m^3/(s Pa)], the ratios of `flow_function` and the upstream air's
    temperature [K].
    """
    direction, upstream, downstream = 1.0, pressure_from, pressure_to
    if pressure_to > pressure_from:
        direction, upstream, downstream = -1.0, pressure_to, pressure_from
    share = flow_function(downstream / upstream, critical_ratio, laminar_ratio)
    cold = math.sqrt(REFERENCE_TEMPERATURE / temperature)
    return direction * conductance * REFERENCE_DENSITY * upstream * cold * share
