"""The muscle of Nguyen 2024, identified element and test loops, as printed, in SI."""

from __future__ import annotations

import functools
import math

from pamsim.core.units import DEG_PER_RAD, PA_PER_BAR
from pamsim.fitting.loop_cost import LoopPoints, maxwell_loop
from pamsim.papers.claim import printed_number, printed_values
from pamsim.physics.braid import Braid, volume, volume_slope
from pamsim.recordings.printed import Printed

MILLIMETRE = 1e-3
"""[m]."""

PERCENT = 1e-2

digits = functools.partial(printed_number, "nguyen2024")
"""A printed number of Nguyen 2024 by its name, with its digits, in its printed unit."""

values = functools.partial(printed_values, "nguyen2024")
"""As `value`, for an entry with several numbers."""


def value(name: str) -> float:
    """As `digits`, without them."""
    return digits(name).value


def muscle() -> Braid:
    """The DMSP-20-300N as its inner diameter, free length and initial fibre angle describe it."""
    return Braid(
        nominal_length=value("free_length") * MILLIMETRE,
        diameter=value("diameter") * MILLIMETRE,
        fibre_angle=value("fibre_angle") / DEG_PER_RAD,
    )


def shape() -> tuple[float, float, float]:
    """Nominal length [m], diameter [m] and fibre angle [rad] of `muscle`."""
    braid = muscle()
    return braid.nominal_length, braid.diameter, braid.fibre_angle


def length_at(contraction: float) -> float:
    """Length [m] at a contraction [-]."""
    return (1.0 - contraction) * muscle().nominal_length


def volume_at(length: float) -> float:
    """Volume (4) of the muscle [m^3] at a length [m]."""
    return volume(length, *shape())


def slope_at(length: float) -> float:
    """dV/dl of (4) [m^2] at a length [m]."""
    return volume_slope(length, *shape())


def slow_start() -> tuple[float, float]:
    """Gauge pressure [Pa] and contraction [-] at which the slow test starts."""
    return value("slow_pressure") * PA_PER_BAR, value("slow_contraction") * PERCENT


def element() -> tuple[float, float, float]:
    """Identified alpha [-], beta [s] and Ke [N/m]; the units of the last two are assumed."""
    order, time_constant, stiffness = (number.value for number in printed_element())
    return order, time_constant, stiffness


def printed_element() -> tuple[Printed, Printed, Printed]:
    """As `element`, with the printed digits."""
    return digits("order"), digits("time_constant"), digits("stiffness")


def omega(frequency: float) -> float:
    """Angular frequency [rad/s] of a frequency [Hz]."""
    return 2.0 * math.pi * frequency


def identification_loops() -> tuple[LoopPoints, ...]:
    """What the ten test loops would be if the identified element were the muscle."""
    return tuple(
        maxwell_loop(*element(), omega(f), value("test_amplitude"))
        for f in values("test_frequencies")
    )
