"""The muscle of Nguyen 2024, identified element and test loops, as printed, in SI."""

from __future__ import annotations

import math

from pamsim.core.units import DEG_PER_RAD
from pamsim.fitting.maxwell import LoopPoints, maxwell_loop
from pamsim.papers.claim import printed_number, printed_values
from pamsim.physics.braid import Braid
from pamsim.recordings.printed import Printed

MILLIMETRE = 1e-3
"""[m]."""

PERCENT = 1e-2


def value(name: str) -> float:
    """A printed number of Nguyen 2024 in its printed unit."""
    return digits(name).value


def digits(name: str) -> Printed:
    """As `value`, with the printed digits."""
    return printed_number("nguyen2024", name)


def muscle() -> Braid:
    """The DMSP-20-300N as its inner diameter, free length and initial fibre angle describe it."""
    return Braid(
        nominal_length=value("free_length") * MILLIMETRE,
        diameter=value("diameter") * MILLIMETRE,
        fibre_angle=value("fibre_angle") / DEG_PER_RAD,
    )


def allowed_stroke() -> float:
    """Printed largest contraction times printed free length [m]."""
    return muscle().nominal_length * value("max_contraction") * PERCENT


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
        for f in printed_values("nguyen2024", "test_frequencies")
    )
