"""Constants of air and of the reference atmosphere."""

GAS_CONSTANT = 287.05
"""Specific gas constant R of dry air [J/(kg K)] (ISO 2533)."""

ATMOSPHERE = 101325.0
"""Standard atmosphere [Pa, absolute] (ISO 2533)."""

REFERENCE_DENSITY = 1.185
"""Density of air at the reference atmosphere ANR, 20 deg C, 100 kPa, 65 % humidity [kg/m^3]
(ISO 8778), to which sonic conductance refers."""

REFERENCE_TEMPERATURE = 293.15
"""Temperature of the reference atmosphere ANR [K] (ISO 8778)."""
