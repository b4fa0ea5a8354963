"""Nguyen 2024, section 2.3: the fractional Maxwell element, its loop (13) and Figure 3."""

from __future__ import annotations

import cmath
import math

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.papers.claim import (
    AGREES,
    Order,
    Recomputed,
    printed_numbers,
    printed_values,
    recomputes,
)
from pamsim.papers.nguyen2024.fractional_reference import (
    complex_stiffness,
    displacement_at_peak_force,
    displacement_at_zero_force,
    loop_distance,
    simulate_fractional,
)
from pamsim.papers.nguyen2024.numbers import element, omega, printed_element, value
from pamsim.papers.rounding import propagated, propagated_each
from pamsim.recordings.printed import Printed

_FREQUENCIES = (1.0, 3.5, 10.0)
"""Ends of the identification tests and the frequency of the first study case [Hz]."""
_PERIODS, _SAMPLES = 30, 200


def simulated_loop(frequency: float, amplitude: float) -> tuple[FloatArray, FloatArray]:
    """Last period of displacement [m] and force [N] of (8), solved with its whole history.

    Args:
        frequency: [Hz].
        amplitude: wanted of the force [N].
    """
    order, beta, stiffness = element()
    reach = amplitude / abs(complex_stiffness(omega(frequency), order, beta, stiffness))
    step = 1.0 / (frequency * _SAMPLES)
    x = reach * np.sin(omega(frequency) * step * np.arange(_PERIODS * _SAMPLES + 1))
    force = simulate_fractional(x, step, order, beta, stiffness)[-_SAMPLES:]
    # A fractional element forgets its start only as a power of time: the loop counts from its mean.
    return x[-_SAMPLES:], force - force.mean()


def _harmonic(samples: FloatArray) -> complex:
    turn = np.exp(-2j * np.pi * np.arange(_SAMPLES) / _SAMPLES)
    return complex(2.0 * np.mean(samples * turn))


def _stiffness_rounding(frequency: float) -> float:
    """What half a unit of alpha, beta and Ke moves the stiffness, over the stiffness [-]."""
    size = propagated(lambda *a: abs(complex_stiffness(omega(frequency), *a)), *printed_element())
    return size.half_unit / size.value


@recomputes("nguyen2024-10")
def _stiffness() -> Recomputed:
    off: list[float] = []
    for frequency in _FREQUENCIES:
        x, force = simulated_loop(frequency, value("test_amplitude"))
        exact = complex_stiffness(omega(frequency), *element())
        off.append(abs(_harmonic(force) / _harmonic(x) / exact - 1.0))
    return Recomputed(
        off,
        high=[_stiffness_rounding(frequency) for frequency in _FREQUENCIES],
        periods=_PERIODS,
        samples=_SAMPLES,
    )


@recomputes("nguyen2024-11")
def _integrated() -> Recomputed:
    order, beta, stiffness = element()
    worst = 0.0
    for frequency in _FREQUENCIES:
        w = omega(frequency)
        u, turn = (w * beta) ** order, 0.5 * math.pi * order
        x = 1.0 / complex_stiffness(w, order, beta, stiffness)  # F = sin w t
        for angle in np.linspace(0.0, 2.0 * math.pi, 16).tolist():
            shift = (x * cmath.exp(1j * angle)).imag
            left = stiffness * u * shift - u * math.sin(angle)
            right = math.sin(angle) * math.cos(turn) - math.cos(angle) * math.sin(turn)
            worst = max(worst, abs(left - right))
    return Recomputed(worst, high=AGREES)


@recomputes("nguyen2024-12")
def _ellipse() -> Recomputed:
    amplitude = value("test_amplitude")
    off: list[float] = []
    limits: list[float] = []
    for frequency in _FREQUENCIES:
        x, force = simulated_loop(frequency, amplitude)
        case = (x, force, amplitude, omega(frequency))
        off.append(float(np.max(np.abs(loop_distance(*case, *element())))))
        each = propagated_each(
            lambda *a, case=case: loop_distance(*case, *a).tolist(), *printed_element()
        )
        limits.append(max(point.half_unit for point in each))
    return Recomputed(off, high=limits)


@recomputes("nguyen2024-13")
def _points() -> Recomputed:
    amplitude, worst = value("test_amplitude"), 0.0
    for frequency in _FREQUENCIES:
        case = (amplitude, omega(frequency), *element())
        x = np.array([displacement_at_peak_force(*case), displacement_at_zero_force(*case)])
        distance = loop_distance(x, np.array([amplitude, 0.0]), *case)
        worst = max(worst, float(np.max(np.abs(distance))))
        if not x[0] > 0.0 > x[1]:
            worst = 1.0
    return Recomputed(min(worst, 1.0), high=AGREES)


@recomputes("nguyen2024-14")
def _unit_of_c() -> Recomputed:
    """Power of the second that c needs for a force in N, at the three orders of the figure."""
    orders = printed_numbers("nguyen2024", "figure_orders")
    return Recomputed(
        orders,
        printed=[Printed(1.0, 0.0)] * len(orders),
        ratio=value("figure_damping") / value("figure_stiffness"),
    )


def _figure(order: float) -> complex:
    """Complex stiffness of Figure 3 at one order [N/m]."""
    stiffness = value("figure_stiffness")
    beta = (value("figure_damping") / stiffness) ** (1.0 / order)
    return complex_stiffness(value("figure_frequency"), order, beta, stiffness)


@recomputes("nguyen2024-15")
def _slope_falls() -> Recomputed:
    result = [abs(_figure(order)) for order in printed_values("nguyen2024", "figure_orders")]
    return Recomputed(result, order=Order.FALLING)


@recomputes("nguyen2024-16")
def _areas() -> Recomputed:
    force = value("figure_amplitude")
    result = [
        -math.pi * force**2 * (1.0 / _figure(order)).imag
        for order in printed_values("nguyen2024", "figure_orders")
    ]
    return Recomputed(tuple(result))
