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
"""Density of air at the reference atmosphere ANR, 20 deg C, 100 kPa, 65 % humidity [kg/m^3]
(ISO 8778), to which sonic conductance refers."""

REFERENCE_TEMPERATURE = 293.15
"""Temperature of the reference atmosphere ANR [K] (ISO 8778)."""


def flow_function(ratio: float, critical_ratio: float, laminar_ratio: float) -> float:
    """Share of the choked flow that passes at a pressure ratio (ISO 6358-1:2013, 3.2 and annex).

    Args:
        ratio: downstream over upstream absolute pressure, in [0, 1].
        critical_ratio: b, below which the flow is choked.
        laminar_ratio: ratio above which the flow is taken as linear in the pressure difference.
            The ellipse has infinite slope at ratio 1, where the flow would not be Lipschitz.

    Returns:
        1 when choked, down to 0 at equal pressures.
    """
    if ratio <= critical_ratio:
        return 1.0
    if ratio < laminar_ratio:
        depth = (ratio - critical_ratio) / (1.0 - critical_ratio)
        return math.sqrt(1.0 - depth * depth)
    depth = (laminar_ratio - critical_ratio) / (1.0 - critical_ratio)
    return math.sqrt(1.0 - depth * depth) * (1.0 - ratio) / (1.0 - laminar_ratio)


def mass_flow(
    pressure_from: float,
    pressure_to: float,
    conductance: float,
    critical_ratio: float,
    laminar_ratio: float,
    temperature: float,
) -> float:
    """Mass flow from one side of an orifice to the other (ISO 6358).

    Args:
        pressure_from: absolute pressure on the first side [Pa].
        pressure_to: absolute pressure on the second side [Pa].
        conductance: sonic conductance C [m^3/(s Pa)].
        critical_ratio: b [-].
        laminar_ratio: see `flow_function` [-].
        temperature: of the upstream air [K].

    Returns:
        mdot [kg/s], positive from the first side to the second, and odd under swapping them.
    """
    direction = 1.0
    upstream = pressure_from
    downstream = pressure_to
    if pressure_to > pressure_from:
        direction = -1.0
        upstream = pressure_to
        downstream = pressure_from
    share = flow_function(downstream / upstream, critical_ratio, laminar_ratio)
    cold = math.sqrt(REFERENCE_TEMPERATURE / temperature)
    return direction * conductance * REFERENCE_DENSITY * upstream * cold * share
