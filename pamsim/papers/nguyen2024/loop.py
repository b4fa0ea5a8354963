"""Nguyen 2024, sections 2.3 and 4.2: the fractional Maxwell element, its loop (13) and Figure 3.

After them stands what the identified alpha, beta and Ke imply for the two study cases.
"""

from __future__ import annotations

import cmath
import itertools
import math
from collections.abc import Callable

import numpy as np

from pamsim.core.units import PA_PER_BAR, FloatArray
from pamsim.fitting.maxwell import maxwell_loop
from pamsim.papers.claim import AGREES, Order, Recomputed, printed_numbers, recomputes
from pamsim.papers.nguyen2024.fractional_reference import (
    complex_stiffness,
    loop_distance,
    simulate_fractional,
)
from pamsim.papers.nguyen2024.geometry import (
    MILLIMETRE,
    PERCENT,
    element,
    length_at,
    muscle,
    omega,
    printed_element,
    slope_at,
    value,
    values,
    volume_at,
)
from pamsim.papers.numerics import derivative, propagated, propagated_each
from pamsim.physics.air import ATMOSPHERE
from pamsim.recordings.printed import Printed

_FREQUENCIES = (1.0, 3.5, 10.0)
"""Ends of the identification tests and the frequency of the first study case [Hz]."""
_PERIODS, _SAMPLES = 30, 200


def simulated_loop(frequency: float, amplitude: float) -> tuple[FloatArray, FloatArray]:
    """Last period of displacement [m] and force [N] of (8), solved with its whole history.

    The force has a frequency [Hz] and a wanted amplitude [N].
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


@recomputes("nguyen2024-10")
def _stiffness() -> Recomputed:
    off: list[float] = []
    rounding: list[float] = []
    for frequency in _FREQUENCIES:
        x, force = simulated_loop(frequency, value("test_amplitude"))
        w = omega(frequency)
        exact = complex_stiffness(w, *element())
        off.append(abs(_harmonic(force) / _harmonic(x) / exact - 1.0))
        # What half a unit of alpha, beta and Ke moves the stiffness, over the stiffness.
        size = propagated(lambda *a, w=w: abs(complex_stiffness(w, *a)), *printed_element())
        rounding.append(size.half_unit / size.value)
    return Recomputed(off, high=rounding, periods=_PERIODS, samples=_SAMPLES)


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
        case = (*simulated_loop(frequency, amplitude), amplitude, omega(frequency))
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
        points = maxwell_loop(*element(), omega(frequency), amplitude)
        x = np.array([points.at_force, points.at_zero])
        case = (np.array([amplitude, 0.0]), amplitude, omega(frequency))
        distance = loop_distance(x, *case, *element())
        worst = max(worst, float(np.max(np.abs(distance))))
        if not x[0] > 0.0 > x[1]:
            worst = 1.0
    return Recomputed(min(worst, 1.0), high=AGREES)


@recomputes("nguyen2024-14")
def _unit_of_c() -> Recomputed:
    """Power of the second that c needs for a force in N, at the three orders of the figure."""
    orders = printed_numbers("nguyen2024", "figure_orders")
    ratio = value("figure_damping") / value("figure_stiffness")
    return Recomputed(orders, printed=[Printed(1.0, 0.0)] * len(orders), ratio=ratio)


def _figure() -> list[complex]:
    """Complex stiffness of Figure 3 at its orders [N/m]."""
    stiffness, frequency = value("figure_stiffness"), value("figure_frequency")
    ratio = value("figure_damping") / stiffness
    return [
        complex_stiffness(frequency, order, ratio ** (1.0 / order), stiffness)
        for order in values("figure_orders")
    ]


@recomputes("nguyen2024-15")
def _slope_falls() -> Recomputed:
    return Recomputed([abs(each) for each in _figure()], order=Order.FALLING)


@recomputes("nguyen2024-16")
def _areas() -> Recomputed:
    force = value("figure_amplitude")
    return Recomputed(tuple(-math.pi * force**2 * (1.0 / each).imag for each in _figure()))


def _dynamic(frequency: float) -> float:
    """|K*| of the identified element [N/m]."""
    return abs(complex_stiffness(omega(frequency), *element()))


@recomputes("nguyen2024-17")
def _stroke() -> Recomputed:
    largest, frequency = max(values("first_case_amplitudes")), value("first_case_frequency")
    travel = 2.0 * (largest / _dynamic(frequency) / MILLIMETRE)
    stroke = muscle().nominal_length * value("max_contraction") * PERCENT / MILLIMETRE
    return Recomputed(travel, high=stroke, stroke=stroke, per_millimetre=travel * MILLIMETRE)


@recomputes("nguyen2024-18")
def _air_stiffness() -> Recomputed:
    pressure = value("test_pressure") * PA_PER_BAR
    result: list[float] = []
    for kappa in np.linspace(0.0, value("max_contraction") * PERCENT, 26).tolist():
        length = length_at(kappa)
        # Isothermal: the softer of the two extremes the closed air can have.
        squeezed = (pressure + ATMOSPHERE) * slope_at(length) ** 2 / volume_at(length)
        result.append(squeezed - pressure * derivative(slope_at, length))
    rubber = _dynamic(value("first_case_frequency"))
    return Recomputed((min(result), rubber), order=Order.RISING)


@recomputes("nguyen2024-19")
def _material_parameter() -> Recomputed:
    order, beta, stiffness = element()
    return Recomputed(stiffness * beta**order)


def _first_case() -> list[tuple[FloatArray, FloatArray]]:
    """Loops of the first study case, one for each of its forces."""
    frequency = value("first_case_frequency")
    return [simulated_loop(frequency, force) for force in values("first_case_amplitudes")]


@recomputes("nguyen2024-20")
def _with_force() -> Recomputed:
    reach = (float(np.max(np.abs(x))) / MILLIMETRE for x, _ in _first_case())
    return Recomputed(tuple(reach), order=Order.RISING)


def _width(frequency: float) -> float:
    """Width of the loop of the second study case where its force is zero [mm]."""
    loop = maxwell_loop(*element(), omega(frequency), value("second_case_amplitude"))
    return -2.0 * loop.at_zero / MILLIMETRE


def _reach(frequency: float) -> float:
    """Displacement amplitude in the second study case [mm]."""
    return value("second_case_amplitude") / _dynamic(frequency) / MILLIMETRE


@recomputes("nguyen2024-21", _reach, Order.FALLING)
@recomputes("nguyen2024-22", _dynamic, Order.RISING)
@recomputes("nguyen2024-23", _width, Order.FALLING)
def _with_frequency(number: Callable[[float], float], order: Order) -> Recomputed:
    result = [number(frequency) for frequency in values("second_case_frequencies")]
    change = 100.0 * (result[-1] / result[0] - 1.0)
    return Recomputed(tuple(result), order=order, rise=change, fall=-change)


@recomputes("nguyen2024-24")
def _less_effect() -> Recomputed:
    losses = [-maxwell_loop(*element(), omega(f), 1.0).at_zero for f in values("test_frequencies")]
    steps = [(a - b) / MILLIMETRE for a, b in itertools.pairwise(losses)]
    return Recomputed(steps, low=0.0, order=Order.FALLING)


@recomputes("nguyen2024-25")
def _amplitude_dependent() -> Recomputed:
    result = [float(np.ptp(force) / np.ptp(x)) for x, force in _first_case()]
    return Recomputed(max(result) / min(result) - 1.0, low=AGREES)
