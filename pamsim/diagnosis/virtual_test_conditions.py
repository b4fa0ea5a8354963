"""Conditions of the virtual tests that give an effect's size in physical terms.

The ground truth of the tests' independent plant is measured under the same.
"""

from __future__ import annotations

PRESSURE = 2.5e5
"""Gauge pressure [Pa]."""

STRAIN = 0.015
"""Amplitude of a muscle's cycle about its nominal length [-]."""

TURN = 0.1
"""Amplitude of the joint's cycles [rad]."""

SLOW, FAST = 0.01, 0.5
"""Speeds of the joint's cycles [rad/s]."""

CONTRACTION_RATE = 0.1
"""Of the braid's test [1/s]."""

CONDITIONS = {
    "at_pressure": (PRESSURE, "Pa"),
    "at_speed": (FAST, "rad/s"),
    "at_contraction_rate": (CONTRACTION_RATE, "1/s"),
    "angle_amplitude": (TURN, "rad"),
    "contraction_amplitude": (STRAIN, "1"),
}
"""Quantity that states a condition -> value [unit] and SI unit."""
