"""Conditions of the virtual tests that give an effect's size in physical terms.

The ground truth of the tests' independent plant is measured under the same.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

PRESSURE = 2.5e5
"""Gauge pressure [Pa]."""

STRAIN = 0.015
"""Amplitude of a muscle's cycle about its nominal length [-]."""

TURN = 0.1
"""Amplitude of the cycles of a joint that turns [rad]."""

SLOW, FAST = 0.01, 0.5
"""Speeds of these cycles [rad/s]."""

ANGLE = 0.5
"""At which the scale of an angle sensor is stated [rad]: near the end of a MAS-20 arm's range."""

_ARM = 0.025
"""A joint that slides is tested over this travel per radian [m], the moment arm of a MAS-20 arm:
its muscle then moves as far and as fast as that of a joint that turns."""

CONTRACTION_RATE = 0.1
"""Of the braid's test [1/s]."""

CONDITIONS = {
    "at_pressure": (PRESSURE, "Pa"),
    "at_speed": (FAST, "rad/s"),
    "at_sliding_speed": (_ARM * FAST, "m/s"),
    "at_contraction_rate": (CONTRACTION_RATE, "1/s"),
    "at_angle": (ANGLE, "rad"),
    "at_position": (_ARM * ANGLE, "m"),
    "angle_amplitude": (TURN, "rad"),
    "stroke_amplitude": (_ARM * TURN, "m"),
    "contraction_amplitude": (STRAIN, "1"),
}
"""Quantity that states a condition -> value [unit] and SI unit."""


@dataclass(frozen=True, kw_only=True)
class Motion:
    """How a joint of one kind is tested, and in which units."""

    unit: str  # SI unit of its position
    effort: str  # what moves it, ``torque`` or ``force``
    effort_unit: str  # SI unit of that
    inertia_unit: str  # SI unit of its inertia
    scale: float  # of the tests of a joint that turns, to positions in ``unit``
    at_speed: str  # condition that states the fast speed
    at_place: str  # condition that states the position of a sensor's test
    amplitude: str  # condition that states the amplitude of its cycles


MOTIONS: Mapping[str, Motion] = {
    "angle": Motion(
        unit="rad",
        effort="torque",
        effort_unit="N*m",
        inertia_unit="kg*m^2",
        scale=1.0,
        at_speed="at_speed",
        at_place="at_angle",
        amplitude="angle_amplitude",
    ),
    "position": Motion(
        unit="m",
        effort="force",
        effort_unit="N",
        inertia_unit="kg",
        scale=_ARM,
        at_speed="at_sliding_speed",
        at_place="at_position",
        amplitude="stroke_amplitude",
    ),
}
"""Kind of a joint, see `pamsim.engine.rig.Rig`, to its tests."""
