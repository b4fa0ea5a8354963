"""Nguyen 2024: the printed muscle and element in SI, section 2.2 and the slow test.

These are its volume (4), the forces of its air (3), (5), and isothermal air (2).
"""

from __future__ import annotations

import functools
import math

import numpy as np

from pamsim.core.units import DEG_PER_RAD, PA_PER_BAR
from pamsim.papers.claim import (
    AGREES,
    Order,
    Recomputed,
    printed_number,
    printed_values,
    recomputes,
)
from pamsim.papers.numerics import propagated
from pamsim.physics.air import ATMOSPHERE
from pamsim.physics.braid import Braid, max_contraction, volume, volume_slope
from pamsim.physics.force_laws.mckibben import elastic_energy_force, ideal_force, ideal_tension
from pamsim.recordings.printed import Printed, printed_table

MILLIMETRE = 1e-3
"""[m]."""

PERCENT = 1e-2

digits = functools.partial(printed_number, "nguyen2024")
"""A printed number of Nguyen 2024 by its name, with its digits, in its printed unit."""

values = functools.partial(printed_values, "nguyen2024")
"""As `value`, for an entry with several numbers."""

_AIR_DIFFUSIVITY = 2.2e-5
"""Thermal diffusivity of air at 1 atm and 300 K [m^2/s], standard tables; falls as 1/pressure."""
_BESSEL_ZERO = 2.4048
"""First zero of J0: the slowest mode in a cylinder dies in (radius / zero)^2 / diffusivity."""
_CONTRACTIONS = np.linspace(0.0, 0.3, 31).tolist()


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


def _fibre_and_turns() -> tuple[float, float]:
    """Length of a fibre [m] and its turns [-]."""
    braid = muscle()
    fibre = braid.nominal_length / math.cos(braid.fibre_angle)
    return fibre, fibre * math.sin(braid.fibre_angle) / (math.pi * braid.diameter)


def isothermal(length: float) -> float:
    """Gauge pressure [Pa] of the air of the slow test at a length [m], by (2)."""
    pressure, contraction = slow_start()
    held = volume_at(length_at(contraction))
    return (pressure + ATMOSPHERE) * held / volume_at(length) - ATMOSPHERE


@recomputes("nguyen2024-01")
def _volume() -> Recomputed:
    fibre, turns = _fibre_and_turns()
    worst, scale = 0.0, abs(slope_at(muscle().nominal_length))
    for length in map(length_at, _CONTRACTIONS):
        by_fibre = length * (fibre**2 - length**2) / (4.0 * math.pi * turns**2)
        slope = (fibre**2 - 3.0 * length**2) / (4.0 * math.pi * turns**2)
        worst = max(worst, abs(by_fibre / volume_at(length) - 1.0))
        worst = max(worst, abs(slope - slope_at(length)) / scale)
    return Recomputed(worst, high=AGREES)


@recomputes("nguyen2024-02")
def _fibre() -> Recomputed:
    fibre, turns = _fibre_and_turns()
    return Recomputed((fibre / MILLIMETRE, turns))


@recomputes("nguyen2024-03")
def _largest_contraction() -> Recomputed:
    needed = math.acos(1.0 / (math.sqrt(3.0) * (1.0 - value("max_contraction") * PERCENT)))
    return Recomputed(
        propagated(
            lambda angle: max_contraction(angle / DEG_PER_RAD) / PERCENT, digits("fibre_angle")
        ),
        needed=needed * DEG_PER_RAD,
    )


@recomputes("nguyen2024-04")
def _contractive_sign() -> Recomputed:
    pressure, step = slow_start()[0], 1e-6
    worst, least = 0.0, math.inf
    for contraction in _CONTRACTIONS:
        length = length_at(contraction)
        work = pressure * (volume_at(length - step) - volume_at(length + step))
        pull = ideal_tension(pressure, contraction, *shape())
        worst, least = max(worst, abs(work / (2.0 * step) - pull)), min(least, pull)
    return Recomputed((worst, least), low=(0.0, 0.0), high=(AGREES * least, None))


@recomputes("nguyen2024-05")
def _restoring_sign() -> Recomputed:
    work, braid = slow_start(), shape()
    at_work, tension = elastic_energy_force(*work, *work, *braid[1:]), ideal_tension(*work, *braid)
    worst = 0.0
    for contraction in _CONTRACTIONS:
        for pressure in (0.5 * work[0], work[0], 1.5 * work[0]):
            result = elastic_energy_force(pressure, contraction, *work, *braid[1:]) + tension
            worst = max(worst, abs(result - ideal_force(pressure, length_at(contraction), *braid)))
    return Recomputed((at_work, worst), low=-AGREES * tension, high=AGREES * tension)


@recomputes("nguyen2024-06")
def _shortening() -> Recomputed:
    length, share = digits("free_length"), digits("slow_contraction")
    return Recomputed(propagated(lambda length, share: length * share * PERCENT, length, share))


@recomputes("nguyen2024-07")
def _isothermal() -> Recomputed:
    pressure, contraction = slow_start()
    length = length_at(contraction)
    ratio = (pressure + ATMOSPHERE) / ATMOSPHERE
    radius_squared = volume_at(length) / (math.pi * length)
    equalised = radius_squared / _BESSEL_ZERO**2 / (_AIR_DIFFUSIVITY / ratio)
    lasts = value("slow_shortening") / value("slow_speed")
    return Recomputed((lasts, equalised), order=Order.FALLING)


@recomputes("nguyen2024-08")
def _curved() -> Recomputed:
    def from_chord(length: float, diameter: float, angle: float, contraction: float) -> float:
        shape = (length, diameter, angle / DEG_PER_RAD)
        kappa = np.linspace(0.0, contraction * PERCENT, 101)
        curve = np.array([volume((1.0 - k) * length, *shape) for k in kappa.tolist()])
        chord = np.interp(kappa, kappa[[0, -1]], curve[[0, -1]])
        return float(np.max(np.abs(curve - chord)) / (curve[-1] - curve[0])) / PERCENT

    names = ("free_length", "diameter", "fibre_angle", "slow_contraction")
    share = propagated(from_chord, *map(digits, names))
    # More than the rounding of what went in could bend a straight line.
    return Recomputed(share.value, low=share.half_unit, rounding=share.half_unit)


@recomputes("nguyen2024-09")
def _below_measured() -> Recomputed:
    work = slow_start()
    rows = [
        [float(row[name]) for name in ("contraction_ratio", "p_gauge_Pa", "force_N")]
        for row in printed_table("dmsp20_300_force_map.csv")
    ]
    calculated: list[float] = []
    measured: list[float] = []
    for contraction in sorted({row[0] for row in rows if row[0] < work[1]}, reverse=True):
        pressure = isothermal(length_at(contraction))
        points = sorted((row[1], row[2]) for row in rows if row[0] == contraction)
        # Beyond the map's highest pressure nothing was measured.
        if pressure <= points[-1][0]:
            calculated.append(elastic_energy_force(pressure, contraction, *work, *shape()[1:]))
            measured.append(float(np.interp(pressure, *np.array(points).T)))
    listed = ", ".join(f"{number:.0f}" for number in measured)
    return Recomputed(calculated, high=measured, measured=listed)
