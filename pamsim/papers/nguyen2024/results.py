"""Nguyen 2024, section 4.2: what alpha, beta and Ke imply, and the two study cases in words."""

from __future__ import annotations

import itertools

import numpy as np

from pamsim.core.units import PA_PER_BAR
from pamsim.fitting.maxwell import maxwell_loop
from pamsim.papers.claim import AGREES, Order, Recomputed, printed_values, recomputes
from pamsim.papers.nguyen2024.fractional_reference import complex_stiffness
from pamsim.papers.nguyen2024.loop import simulated_loop
from pamsim.papers.nguyen2024.numbers import (
    MILLIMETRE,
    PERCENT,
    allowed_stroke,
    element,
    muscle,
    omega,
    value,
)
from pamsim.papers.numerics import derivative
from pamsim.physics.air import ATMOSPHERE
from pamsim.physics.braid import volume, volume_slope


def _dynamic(frequency: float) -> float:
    """|K*| of the identified element [N/m]."""
    return abs(complex_stiffness(omega(frequency), *element()))


def _reach(frequency: float, force: float) -> float:
    """Displacement amplitude [mm]."""
    return force / _dynamic(frequency) / MILLIMETRE


@recomputes("nguyen2024-17")
def _stroke() -> Recomputed:
    largest = max(printed_values("nguyen2024", "first_case_amplitudes"))
    travel = 2.0 * _reach(value("first_case_frequency"), largest)
    stroke = allowed_stroke() / MILLIMETRE
    return Recomputed(travel, high=stroke, stroke=stroke, per_millimetre=travel * MILLIMETRE)


@recomputes("nguyen2024-18")
def _air_stiffness() -> Recomputed:
    braid, pressure = muscle(), value("test_pressure") * PA_PER_BAR
    shape = (braid.nominal_length, braid.diameter, braid.fibre_angle)
    result: list[float] = []
    for kappa in np.linspace(0.0, value("max_contraction") * PERCENT, 26).tolist():
        length = (1.0 - kappa) * braid.nominal_length
        slope = volume_slope(length, *shape)
        # Isothermal: the softer of the two extremes the closed air can have.
        squeezed = (pressure + ATMOSPHERE) * slope**2 / volume(length, *shape)
        result.append(squeezed - pressure * derivative(lambda at: volume_slope(at, *shape), length))
    rubber = _dynamic(value("first_case_frequency"))
    return Recomputed((min(result), rubber), order=Order.RISING)


@recomputes("nguyen2024-19")
def _material_parameter() -> Recomputed:
    order, beta, stiffness = element()
    return Recomputed(stiffness * beta**order)


@recomputes("nguyen2024-20")
def _with_force() -> Recomputed:
    frequency = value("first_case_frequency")
    result: list[float] = []
    for force in printed_values("nguyen2024", "first_case_amplitudes"):
        x, _ = simulated_loop(frequency, force)
        result.append(float(np.max(np.abs(x))) / MILLIMETRE)
    return Recomputed(tuple(result), order=Order.RISING)


@recomputes("nguyen2024-21")
def _with_frequency() -> Recomputed:
    force = value("second_case_amplitude")
    result = [_reach(f, force) for f in printed_values("nguyen2024", "second_case_frequencies")]
    return Recomputed(
        tuple(result),
        order=Order.FALLING,
        fall=100.0 * (1.0 - result[-1] / result[0]),
    )


@recomputes("nguyen2024-22")
def _stiffer() -> Recomputed:
    result = [_dynamic(f) for f in printed_values("nguyen2024", "second_case_frequencies")]
    return Recomputed(
        tuple(result),
        order=Order.RISING,
        rise=100.0 * (result[-1] / result[0] - 1.0),
    )


@recomputes("nguyen2024-23")
def _narrower() -> Recomputed:
    force = value("second_case_amplitude")
    result = [
        -2.0 * maxwell_loop(*element(), omega(frequency), force).at_zero / MILLIMETRE
        for frequency in printed_values("nguyen2024", "second_case_frequencies")
    ]
    return Recomputed(
        tuple(result),
        order=Order.FALLING,
        fall=100.0 * (1.0 - result[-1] / result[0]),
    )


@recomputes("nguyen2024-24")
def _less_effect() -> Recomputed:
    frequencies = printed_values("nguyen2024", "test_frequencies")
    losses = [-maxwell_loop(*element(), omega(f), 1.0).at_zero for f in frequencies]
    steps = [a - b for a, b in itertools.pairwise(losses)]
    return Recomputed([step / MILLIMETRE for step in steps], low=0.0, order=Order.FALLING)


@recomputes("nguyen2024-25")
def _amplitude_dependent() -> Recomputed:
    frequency = value("first_case_frequency")
    result: list[float] = []
    for force in printed_values("nguyen2024", "first_case_amplitudes"):
        x, f = simulated_loop(frequency, force)
        result.append(float(np.ptp(f) / np.ptp(x)))
    change = max(result) / min(result) - 1.0
    return Recomputed(change, low=AGREES)
