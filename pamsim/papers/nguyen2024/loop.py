"""Nguyen 2024, section 2.3: the fractional Maxwell element, its loop (13) and Figure 3."""

from __future__ import annotations

import cmath
import math

import numpy as np
from numpy.typing import NDArray

from pamsim.hysteresis.fractional_maxwell import complex_stiffness
from pamsim.hysteresis.fractional_reference import (
    displacement_at_peak_force,
    displacement_at_zero_force,
    loop_distance,
    simulate_fractional,
)
from pamsim.papers.claim import Claim, Verdict, compare, holds
from pamsim.papers.nguyen2024.numbers import element, omega, value
from pamsim.papers.printed_number import printed_values

FloatArray = NDArray[np.float64]

_FREQUENCIES = (1.0, 3.5, 10.0)
"""Ends of the identification tests and the frequency of the first study case [Hz]."""
_PERIODS, _SAMPLES = 30, 200
_SIMULATED = 0.01
"""Allowed for steps of 1/200 period and for what is left of the start after 30 periods."""


def claims() -> list[Claim]:
    """Claims C-10 to C-16."""
    return [
        _stiffness(),
        _integrated(),
        _ellipse(),
        _points(),
        _unit_of_c(),
        _slopes(),
        _areas(),
    ]


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


def _stiffness() -> Claim:
    off: list[float] = []
    for frequency in _FREQUENCIES:
        x, force = simulated_loop(frequency, value("test_amplitude"))
        exact = complex_stiffness(omega(frequency), *element())
        off.append(abs(_harmonic(force) / _harmonic(x) / exact - 1.0))
    return compare(
        "C-10",
        "(9) is the Fourier transform of (8) with (7): relative deviation of the complex stiffness"
        " at 1, 3.5 and 10 Hz",
        (0.0,) * len(off),
        off,
        _SIMULATED,
        unit="1",
        reason=f"(8) solved in time with the derivative (7) and its whole history, {_PERIODS}"
        f" periods of {_SAMPLES} steps, alpha, beta and Ke as identified; first harmonics of the"
        " last period",
        otherwise=Verdict.INCONSISTENT,
    )


def _integrated() -> Claim:
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
    return compare(
        "C-11",
        "(10) to (12): fractional integration of (9) under a harmonic force; deviation of (12) over"
        " F0",
        0.0,
        worst,
        1e-12,
        unit="1",
        reason="both sides of (12) at 16 phases of three loops, with the displacement from (9);"
        " the lost minus signs are those of sin(wt - alpha pi/2)",
        otherwise=Verdict.INCONSISTENT,
    )


def _ellipse() -> Claim:
    amplitude = value("test_amplitude")
    off: list[float] = []
    for frequency in _FREQUENCIES:
        x, force = simulated_loop(frequency, amplitude)
        distance = loop_distance(x, force, amplitude, omega(frequency), *element())
        off.append(float(np.max(np.abs(distance))))
    return compare(
        "C-12",
        "(13) is the loop of (8): largest distance of the loop from it over F0 at 1, 3.5 and 10 Hz",
        (0.0,) * len(off),
        off,
        _SIMULATED,
        unit="1",
        reason="loops simulated as for C-10, force amplitude 150 N",
        otherwise=Verdict.INCONSISTENT,
    )


def _points() -> Claim:
    amplitude, worst = value("test_amplitude"), 0.0
    for frequency in _FREQUENCIES:
        case = (amplitude, omega(frequency), *element())
        x = np.array([displacement_at_peak_force(*case), displacement_at_zero_force(*case)])
        distance = loop_distance(x, np.array([amplitude, 0.0]), *case)
        worst = max(worst, float(np.max(np.abs(distance))))
        if not x[0] > 0.0 > x[1]:
            worst = math.inf
    return compare(
        "C-13",
        "(14) and (15) are the points F = F0, x1 > 0 and F = 0, x2 < 0 of (13): distance over F0",
        0.0,
        min(worst, 1.0),
        1e-12,
        unit="1",
        reason="with the lost minus of (14) restored; the plus of (15) is printed and right for"
        " x2 < 0",
        otherwise=Verdict.INCONSISTENT,
    )


def _unit_of_c() -> Claim:
    return Claim(
        id="C-14",
        what="c of (6) in the caption of Figure 3",
        printed="200,000 Ns/m",
        recomputed="200,000 N s^alpha/m",
        unit="",
        verdict=Verdict.INCONSISTENT,
        reason="c times a derivative of order alpha is a force only in N s^alpha/m, so one number"
        " in one unit cannot serve the three orders of the figure; beta^alpha = c/Ke is taken as"
        f" printed, {value('figure_damping') / value('figure_stiffness'):.3f} s^alpha for all",
    )


def _figure(order: float) -> complex:
    """Complex stiffness of Figure 3 at one order [N/m]."""
    stiffness = value("figure_stiffness")
    beta = (value("figure_damping") / stiffness) ** (1.0 / order)
    return complex_stiffness(value("figure_frequency"), order, beta, stiffness)


def _slopes() -> Claim:
    found = [abs(_figure(order)) for order in printed_values("C", "figure_orders")]
    return Claim(
        id="C-15",
        what="Figure 3: the slope of the loop falls with alpha, 0.8, 0.5 and 0.2",
        printed="the slope is reduced with the decrease of alpha",
        recomputed=tuple(found),
        unit="N/m",
        verdict=holds(found[0] > found[1] > found[2], Verdict.INCONSISTENT),
        reason="force amplitude over displacement amplitude, |K*| of (9), with beta^alpha = c/Ke ="
        " 4/3",
    )


def _areas() -> Claim:
    force = value("figure_amplitude")
    found = [
        -math.pi * force**2 * (1.0 / _figure(order)).imag
        for order in printed_values("C", "figure_orders")
    ]
    return Claim(
        id="C-16",
        what="area of the three loops of Figure 3, alpha 0.8, 0.5 and 0.2",
        printed="drawn, not printed",
        recomputed=tuple(found),
        unit="J",
        verdict=Verdict.NOT_REPRODUCIBLE,
        reason="pi F0^2 times the imaginary part of 1/K*; largest for the middle order, so not only"
        " the slope changes with alpha. The figure gives no number to compare with",
    )
