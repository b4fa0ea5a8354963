"""Nguyen 2024: the printed muscle and element in SI, section 2.2 and the slow test.

These are its volume (4), the forces of its air (3), (5), and isothermal air (2).
"""

from __future__ import annotations

import math

import numpy as np

from pamsim.core.units import DEG_PER_RAD, PA_PER_BAR, FloatArray
from pamsim.papers.claim import Order, Recomputed, recomputes
from pamsim.papers.numerics import PrintedNumbers, propagated
from pamsim.physics.air import ATMOSPHERE
from pamsim.physics.braid import Braid, max_contraction, volume, volume_slope
from pamsim.physics.force_laws.mckibben import elastic_energy_force
from pamsim.recordings.printed import Printed, printed_table

MILLIMETRE = 1e-3
"""[m]."""

PERCENT = 1e-2

PRINTED = PrintedNumbers("nguyen2024")
value, values, digits = PRINTED.value, PRINTED.values, PRINTED.digits

_AIR_DIFFUSIVITY = 2.2e-5
"""Thermal diffusivity of air at 1 atm and 300 K [m^2/s], standard tables; falls as 1/pressure."""
_BESSEL_ZERO = 2.4048
"""First zero of J0: the slowest mode in a cylinder dies in (radius / zero)^2 / diffusivity."""


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
    return value("order"), value("time_constant"), value("stiffness")


def printed_element() -> tuple[Printed, Printed, Printed]:
    """As `element`, with the printed digits."""
    return digits("order"), digits("time_constant"), digits("stiffness")


def omega(frequency: float) -> float:
    """Angular frequency [rad/s] of a frequency [Hz]."""
    return 2.0 * math.pi * frequency


def isothermal(length: float) -> float:
    """Gauge pressure [Pa] of the air of the slow test at a length [m], by (2)."""
    pressure, contraction = slow_start()
    held = volume_at(length_at(contraction))
    return (pressure + ATMOSPHERE) * held / volume_at(length) - ATMOSPHERE


def force_map(file: str) -> FloatArray:
    """A published force map (3, n): gauge pressures [Pa], contractions [-], forces [N]."""
    names = ("p_gauge_Pa", "contraction_ratio", "force_N")
    return np.array([[float(row[name]) for row in printed_table(file)] for name in names])


@recomputes("nguyen2024-02")
def _fibre_and_turns() -> tuple[float, float]:
    length, diameter, angle = shape()
    fibre = length / math.cos(angle)
    return fibre / MILLIMETRE, fibre * math.sin(angle) / (math.pi * diameter)


@recomputes("nguyen2024-03")
def _largest_contraction() -> Recomputed:
    needed = math.acos(1.0 / (math.sqrt(3.0) * (1.0 - value("max_contraction") * PERCENT)))
    return Recomputed(
        propagated(
            lambda angle: max_contraction(angle / DEG_PER_RAD) / PERCENT, digits("fibre_angle")
        ),
        needed=needed * DEG_PER_RAD,
    )


@recomputes("nguyen2024-06")
def _shortening() -> Printed:
    lengths = digits("free_length"), digits("slow_contraction")
    return propagated(lambda length, share: length * share * PERCENT, *lengths)


@recomputes("nguyen2024-07")
def _isothermal() -> Recomputed:
    pressure, contraction = slow_start()
    length = length_at(contraction)
    ratio = (pressure + ATMOSPHERE) / ATMOSPHERE
    radius_squared = volume_at(length) / (math.pi * length)
    equalised = radius_squared / _BESSEL_ZERO**2 / (_AIR_DIFFUSIVITY / ratio)
    lasts = value("slow_shortening") / value("slow_speed")
    return Recomputed((lasts, equalised), order=Order.FALLING)


@recomputes("nguyen2024-09")
def _below_measured() -> Recomputed:
    work, (pressures, contractions, forces) = slow_start(), force_map("dmsp20_300_force_map.csv")
    calculated: list[float] = []
    measured: list[float] = []
    for contraction in np.unique(contractions[contractions < work[1]])[::-1].tolist():
        pressure = isothermal(length_at(contraction))
        here = np.flatnonzero(contractions == contraction)
        here = here[np.argsort(pressures[here])]
        # Beyond the map's highest pressure nothing was measured.
        if pressure <= pressures[here[-1]]:
            calculated.append(elastic_energy_force(pressure, contraction, *work, *shape()[1:]))
            measured.append(float(np.interp(pressure, pressures[here], forces[here])))
    listed = ", ".join(f"{number:.0f}" for number in measured)
    return Recomputed(calculated, high=measured, measured=listed)
