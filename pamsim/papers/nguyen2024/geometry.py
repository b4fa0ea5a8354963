"""Section 2.2 and the slow test: volume (4), air forces (3), (5), isothermal air (2)."""

from __future__ import annotations

import math

import numpy as np

from pamsim.core.units import DEG_PER_RAD, PA_PER_BAR
from pamsim.papers.claim import AGREES, Order, Recomputed, recomputes
from pamsim.papers.nguyen2024.numbers import MILLIMETRE, PERCENT, digits, muscle, value
from pamsim.papers.rounding import propagated
from pamsim.physics.air import ATMOSPHERE
from pamsim.physics.braid import max_contraction, volume, volume_slope
from pamsim.physics.force_laws.mckibben import elastic_energy_force, ideal_force, ideal_tension
from pamsim.recordings.printed import printed_table

_AIR_DIFFUSIVITY = 2.2e-5
"""Thermal diffusivity of air at 1 atm and 300 K [m^2/s], standard tables; falls as 1/pressure."""
_BESSEL_ZERO = 2.4048
"""First zero of J0: the slowest mode in a cylinder dies in (radius / zero)^2 / diffusivity."""
_CONTRACTIONS = np.linspace(0.0, 0.3, 31).tolist()


def _fibre_and_turns() -> tuple[float, float]:
    """Length of a fibre [m] and its turns [-]."""
    braid = muscle()
    fibre = braid.nominal_length / math.cos(braid.fibre_angle)
    return fibre, fibre * math.sin(braid.fibre_angle) / (math.pi * braid.diameter)


@recomputes("nguyen2024-01")
def _volume() -> Recomputed:
    braid, (fibre, turns) = muscle(), _fibre_and_turns()
    shape = (braid.nominal_length, braid.diameter, braid.fibre_angle)
    worst = 0.0
    for contraction in _CONTRACTIONS:
        length = (1.0 - contraction) * braid.nominal_length
        by_fibre = length * (fibre**2 - length**2) / (4.0 * math.pi * turns**2)
        slope = (fibre**2 - 3.0 * length**2) / (4.0 * math.pi * turns**2)
        worst = max(worst, abs(by_fibre / volume(length, *shape) - 1.0))
        scale = abs(volume_slope(braid.nominal_length, *shape))
        worst = max(worst, abs(slope - volume_slope(length, *shape)) / scale)
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
    braid = muscle()
    shape = (braid.nominal_length, braid.diameter, braid.fibre_angle)
    pressure, step = value("slow_pressure") * PA_PER_BAR, 1e-6
    worst, least = 0.0, math.inf
    for contraction in _CONTRACTIONS:
        length = (1.0 - contraction) * braid.nominal_length
        work = pressure * (volume(length - step, *shape) - volume(length + step, *shape))
        pull = ideal_tension(pressure, contraction, *shape)
        worst, least = max(worst, abs(work / (2.0 * step) - pull)), min(least, pull)
    return Recomputed((worst, least), low=(0.0, 0.0), high=(AGREES * least, None))


@recomputes("nguyen2024-05")
def _restoring_sign() -> Recomputed:
    braid = muscle()
    shape = (braid.nominal_length, braid.diameter, braid.fibre_angle)
    work = (value("slow_pressure") * PA_PER_BAR, value("slow_contraction") * PERCENT)
    at_work = elastic_energy_force(*work, *work, *shape[1:])
    worst = 0.0
    for contraction in _CONTRACTIONS:
        for pressure in (0.5 * work[0], work[0], 1.5 * work[0]):
            result = elastic_energy_force(pressure, contraction, *work, *shape[1:])
            result += ideal_tension(*work, *shape)
            length = (1.0 - contraction) * braid.nominal_length
            worst = max(worst, abs(result - ideal_force(pressure, length, *shape)))
    slack = AGREES * ideal_tension(*work, *shape)
    return Recomputed((at_work, worst), low=-slack, high=slack)


@recomputes("nguyen2024-06")
def _shortening() -> Recomputed:
    return Recomputed(
        propagated(
            lambda length, share: length * share * PERCENT,
            digits("free_length"),
            digits("slow_contraction"),
        )
    )


@recomputes("nguyen2024-07")
def _isothermal() -> Recomputed:
    braid = muscle()
    length = braid.nominal_length * (1.0 - value("slow_contraction") * PERCENT)
    held = volume(length, braid.nominal_length, braid.diameter, braid.fibre_angle)
    ratio = (value("slow_pressure") * PA_PER_BAR + ATMOSPHERE) / ATMOSPHERE
    radius_squared = held / (math.pi * length)
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
    braid = muscle()
    shape = (braid.nominal_length, braid.diameter, braid.fibre_angle)
    work = (value("slow_pressure") * PA_PER_BAR, value("slow_contraction") * PERCENT)
    held = volume((1.0 - work[1]) * braid.nominal_length, *shape)
    rows = [
        [float(row[name]) for name in ("contraction_ratio", "p_gauge_Pa", "force_N")]
        for row in printed_table("dmsp20_300_force_map.csv")
    ]
    calculated: list[float] = []
    measured: list[float] = []
    for contraction in sorted({row[0] for row in rows if row[0] < work[1]}, reverse=True):
        now = volume((1.0 - contraction) * braid.nominal_length, *shape)
        pressure = (work[0] + ATMOSPHERE) * held / now - ATMOSPHERE
        points = sorted((row[1], row[2]) for row in rows if row[0] == contraction)
        # Beyond the map's highest pressure nothing was measured.
        if pressure <= points[-1][0]:
            calculated.append(elastic_energy_force(pressure, contraction, *work, *shape[1:]))
            measured.append(float(np.interp(pressure, *np.array(points).T)))
    return Recomputed(calculated, high=measured, measured=_words(measured))


def _words(numbers: list[float]) -> str:
    return ", ".join(f"{number:.0f}" for number in numbers)
