"""Braid geometry of a McKibben muscle: inner volume V(l) from inextensible helical fibres.

A fibre of length b wound n turns round a cylinder of length l and diameter D satisfies
l = b cos(theta), pi n D = b sin(theta), so the enclosed volume is
V = l (b^2 - l^2) / (4 pi n^2)  (Nguyen 2024, equation (4); Chou and Hannaford 1996).
Here b and n are replaced by what a data sheet prints: nominal length l0, diameter D0 and fibre
angle alpha0 at l0, with b = l0 / cos(alpha0) and n = b sin(alpha0) / (pi D0).
"""

from __future__ import annotations

import math

from pamsim.core.parameters import ParameterGroup, quantity

_ROUNDING = 1e-9  # share of a volume


class Braid(ParameterGroup, group="braid"):
    """Size and fibre angle of the braid at nominal length."""

    nominal_length: float = quantity("[0.001, 10] m", "length l0 without pressure or load")
    diameter: float = quantity("[0.0001, 0.5] m", "inner diameter D0 at nominal length")
    fibre_angle: float = quantity(
        "[0.05, 0.95] rad", "angle of the fibres to the axis at nominal length"
    )
    extensibility: float = quantity(
        "[0, 1e-6] 1/Pa",
        "growth of the free length per gauge pressure, as the fibres stretch; the locking"
        " length is fixed",
        0.0,
    )
    friction: float = quantity(
        "[0, 1] N*s/Pa",
        "force lost per gauge pressure and rate of contraction, as the fibres rub; limits the time"
        " step",
        0.0,
    )


def volume(length: float, nominal_length: float, diameter: float, fibre_angle: float) -> float:
    """Inner volume V of the braid at a length l [m^3] (Nguyen 2024, equation (4)).

    Zero where the fibres lie straight; NaN for a longer muscle, which there is not. Lengths in m,
    the angle in rad.
    """
    sine = math.sin(fibre_angle)
    stretch = length / nominal_length
    hollow = 1.0 - stretch * stretch * (1.0 - sine * sine)
    if hollow < -_ROUNDING:
        return math.nan
    return 0.25 * math.pi * diameter * diameter * length * hollow / (sine * sine)


def volume_slope(
    length: float, nominal_length: float, diameter: float, fibre_angle: float
) -> float:
    """First derivative dV/dl [m^2] of `volume`, whose arguments it takes (Nguyen 2024, under (4)).

    Negative while the muscle can pull. It goes on falling beyond straight fibres.
    """
    sine = math.sin(fibre_angle)
    stretch = length / nominal_length
    slope = 1.0 - 3.0 * stretch * stretch * (1.0 - sine * sine)
    return 0.25 * math.pi * diameter * diameter * slope / (sine * sine)


def volume_gained(contraction: float, diameter: float, fibre_angle: float) -> float:
    """Volume that the braid gains from nominal length to kappa, per nominal length [m^2]."""
    # V / l0 depends on l/l0 alone, so lengths are taken in units of l0.
    start = volume(1.0, 1.0, diameter, fibre_angle)
    return volume(1.0 - contraction, 1.0, diameter, fibre_angle) - start


def max_contraction(fibre_angle: float) -> float:
    """Contraction at which the ideal muscle stops pulling [-], from the fibre angle alpha0 [rad].

    There cos(theta) = 1/sqrt(3), 54.7 deg, so kappa_max = 1 - 1 / (sqrt(3) cos(alpha0)).
    """
    return 1.0 - 1.0 / (math.sqrt(3.0) * math.cos(fibre_angle))
