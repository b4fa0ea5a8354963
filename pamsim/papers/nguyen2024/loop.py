"""Nguyen 2024: the fractional Maxwell element, its loop (13), Figure 3 and both study cases.

`simulate_fractional` solves (8) with the derivative (7) itself and its whole history; slow, and of
a known order. `loop_distance` is the printed loop (13), with which the paper identifies the
element. Its order is alpha [-], its time constant beta [s] and its stiffness K_e [N/m]; omega is
the angular frequency w [rad/s], positive, and amplitude F_0 [N].

After them stands whether the cost (16) and the water cycle algorithm determine the element.
"""

from __future__ import annotations

import cmath
import functools
import math

import numpy as np

from pamsim.core.units import PA_PER_BAR, FloatArray
from pamsim.fitting.maxwell import MAXWELL, LoopPoints, maxwell_loop, maxwell_residual
from pamsim.fitting.water_cycle import SearchRun, compare_searches, water_cycle
from pamsim.papers.claim import AGREES, Order, Recomputed, recomputes
from pamsim.papers.nguyen2024.geometry import (
    MILLIMETRE,
    PERCENT,
    PRINTED,
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
from pamsim.papers.numerics import derivative, half_unit, propagated, propagated_each
from pamsim.physics.air import ATMOSPHERE
from pamsim.recordings.printed import Printed

_FREQUENCIES = (1.0, 3.5, 10.0)
"""Ends of the identification tests and the frequency of the first study case [Hz]."""
_PERIODS, _SAMPLES = 30, 200

_BOX = ((0.01, 0.99), (1.0, 200.0), (1e2, 1e4))
"""Of alpha [-], beta [s], Ke [N/m], round the printed numbers; the paper prints no box."""
_SEEDS = range(5)
_NOISE = 0.01
_ROUNDING = 1e-20
"""Cost below which it is rounding, which differs between processors [N^2]."""


def complex_stiffness(
    omega: float, order: float, time_constant: float, stiffness: float
) -> complex:
    """K*(w) = K_e (jw beta)^alpha / (1 + (jw beta)^alpha) [N/m] (Nguyen 2024, (9))."""
    z = (omega * time_constant) ** order * cmath.exp(0.5j * math.pi * order)
    return stiffness * z / (1.0 + z)


def simulate_fractional(
    x: FloatArray, step: float, order: float, time_constant: float, stiffness: float
) -> FloatArray:
    """Force (n,) [N] of the element by Nguyen 2024, (8), with its whole history.

    With q = x - F/K_e the equation reads beta^alpha D^alpha q = F/K_e, which the L1 scheme solves
    step by step [s] for the newest q. The displacement x (n,) [m] is from rest, x_0 = 0.

    By the L1 scheme D^alpha y(t_n) is the sum of b_j (y_(n-j) - y_(n-j-1)) over h^alpha Gamma(2 -
    alpha) with b_j = (j + 1)^(1 - alpha) - j^(1 - alpha), and an error of order h^(2 - alpha) for
    smooth y (Oldham and Spanier 1974; Lin and Xu 2007).
    """
    weights = np.diff(np.arange(len(x) + 1.0) ** (1.0 - order))
    scale = (time_constant / step) ** order / math.gamma(2.0 - order)
    q = np.zeros(len(x))
    increments = np.zeros(len(x))
    for n in range(1, len(x)):
        history = float(np.dot(weights[1:n], increments[n - 1 : 0 : -1]))
        q[n] = (x[n] + scale * (q[n - 1] - history)) / (1.0 + scale)
        increments[n] = q[n] - q[n - 1]
    return stiffness * (x - q)


def loop_distance(
    x: FloatArray,
    force: FloatArray,
    amplitude: float,
    omega: float,
    order: float,
    time_constant: float,
    stiffness: float,
) -> FloatArray:
    """How far points (n,) [m], [N] lie from the loop (13) of Nguyen 2024 under F = F_0 sin(w t).

    The two squares in (13) are cos^2 and sin^2 of w t, so their root less 1 is the radial distance
    in units of F_0 [-], 0 on the loop.
    """
    u = (omega * time_constant) ** order
    turn = 0.5 * math.pi * order
    along = (stiffness * u * x - (u + math.cos(turn)) * force) / (amplitude * math.sin(turn))
    return np.hypot(along, force / amplitude) - 1.0


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


def harmonic(samples: FloatArray) -> complex:
    """First harmonic of the samples (n,) of one period, in their unit."""
    turn = np.exp(-2j * np.pi * np.arange(len(samples)) / len(samples))
    return complex(2.0 * np.mean(samples * turn))


@recomputes("nguyen2024-10")
def _stiffness() -> Recomputed:
    off: list[float] = []
    rounding: list[float] = []
    for frequency in _FREQUENCIES:
        x, force = simulated_loop(frequency, value("test_amplitude"))
        w = omega(frequency)
        exact = complex_stiffness(w, *element())
        off.append(abs(harmonic(force) / harmonic(x) / exact - 1.0))
        # What half a unit of alpha, beta and Ke moves the stiffness, over the stiffness.
        size = propagated(lambda *a, w=w: abs(complex_stiffness(w, *a)), *printed_element())
        rounding.append(size.half_unit / size.value)
    return Recomputed(off, high=rounding, periods=_PERIODS, samples=_SAMPLES)


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


@recomputes("nguyen2024-14")
def _unit_of_c() -> Recomputed:
    """Power of the second that c needs for a force in N, at the three orders of the figure."""
    orders = PRINTED.all_digits("figure_orders")
    ratio = value("figure_damping") / value("figure_stiffness")
    return Recomputed(orders, printed=[Printed(1.0, 0.0)] * len(orders), ratio=ratio)


def figure_elements() -> list[tuple[float, float, float]]:
    """Order [-], time constant [s] and stiffness [N/m] of each element of Figure 3."""
    stiffness = value("figure_stiffness")
    ratio = value("figure_damping") / stiffness
    return [(order, ratio ** (1.0 / order), stiffness) for order in values("figure_orders")]


def _figure() -> list[complex]:
    """Complex stiffness of Figure 3 at its orders [N/m]."""
    return [complex_stiffness(value("figure_frequency"), *law) for law in figure_elements()]


@recomputes("nguyen2024-15")
def _slope_falls() -> Recomputed:
    return Recomputed([abs(each) for each in _figure()], order=Order.FALLING)


@recomputes("nguyen2024-16")
def _areas() -> list[float]:
    force = value("figure_amplitude")
    return [-math.pi * force**2 * (1.0 / each).imag for each in _figure()]


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
def _material_parameter() -> float:
    order, beta, stiffness = element()
    return stiffness * beta**order


@recomputes("nguyen2024-25")
def _amplitude_dependent() -> Recomputed:
    frequency = value("first_case_frequency")
    loops = [simulated_loop(frequency, force) for force in values("first_case_amplitudes")]
    ratios = [float(np.ptp(force) / np.ptp(x)) for x, force in loops]
    return Recomputed(max(ratios) / min(ratios) - 1.0, low=AGREES)


@functools.cache
def _loops() -> tuple[LoopPoints, ...]:
    """What the ten test loops would be if the identified element were the muscle."""
    return tuple(
        maxwell_loop(*element(), omega(f), value("test_amplitude"))
        for f in values("test_frequencies")
    )


@functools.cache
def _searches() -> dict[str, SearchRun]:
    runs = compare_searches(
        lambda place: maxwell_residual(place, _loops()),
        [c.low for c in MAXWELL],
        [c.high for c in MAXWELL],
        tolerance=1e-3,
        iterations=100,
    )
    return {run.method: run for run in runs}


@recomputes("nguyen2024-28", each=("least_squares", "differential_evolution", "water_cycle"))
def _recovered(method: str) -> Recomputed:
    run = _searches()[method]
    limits = {
        f"{name}_{end}": 10.0 ** getattr(coordinate, end)
        for name, coordinate in zip(("beta", "stiffness"), MAXWELL[1:], strict=True)
        for end in ("low", "high")
    }
    result = (run.x[0], 10.0 ** run.x[1], 10.0 ** run.x[2])
    cost = max(run.value, _ROUNDING)
    return Recomputed(result, cost=cost, evaluations=run.evaluations, **limits)


def _residual(element: FloatArray) -> FloatArray:
    """Residual of the cost (16) at alpha [-], beta [s], Ke [N/m]."""
    alpha, beta, stiffness = element
    return maxwell_residual(np.array([alpha, math.log10(beta), math.log10(stiffness)]), _loops())


@recomputes("nguyen2024-31")
def _converged() -> Recomputed:
    count = int(value("converged_after"))

    def cost(place: FloatArray) -> float:
        miss = _residual(place)
        return float(miss @ miss)

    low, high = zip(*_BOX, strict=True)
    runs = [
        water_cycle(
            cost, low, high, rng=np.random.default_rng(seed), iterations=count, shrinking=True
        )
        for seed in _SEEDS
    ]
    runs.sort(key=lambda run: run.value)
    rounded = propagated(lambda *place: cost(np.array(place)), *printed_element())
    return Recomputed(
        runs[len(runs) // 2].x.tolist(),
        seeds=len(runs),
        least=runs[0].value,
        most=runs[-1].value,
        least_order=min(run.x[0] for run in runs),
        most_order=max(run.x[0] for run in runs),
        rounding=rounded.half_unit,
    )


@recomputes("nguyen2024-32")
def _digits() -> Recomputed:
    loops, (alpha, beta, stiffness), step = _loops(), element(), 1e-6

    def residual(logs: FloatArray) -> FloatArray:
        return _residual(np.array([alpha, beta, stiffness]) * np.exp(logs))

    columns = [(residual(step * e) - residual(-step * e)) / (2.0 * step) for e in np.eye(3)]
    inverse = np.linalg.pinv(np.stack(columns, axis=1))
    # The cost is linear in the measured x1, x2: Ke (w beta)^alpha each.
    gain = np.repeat([(loop.frequency * beta) ** alpha * stiffness for loop in loops], 2)
    size = np.array([abs(x) for loop in loops for x in (loop.at_force, loop.at_zero)])
    half = 1.96 * np.sqrt(np.sum((inverse * (gain * _NOISE * size)) ** 2, axis=1))
    digits = tuple(number.half_unit / number.value for number in printed_element())
    return Recomputed(tuple(half.tolist()), printed=digits, high=digits)


@recomputes("nguyen2024-33")
def _shares() -> Recomputed:
    rivers, population = 3, 50
    rng = np.random.default_rng(0)
    fitness = np.sort(rng.uniform(1.0, 100.0, population))
    lead = np.abs(fitness[: rivers + 1] - fitness[rivers + 1])
    streams = population - (rivers + 1)
    printed = float(np.sum(np.round(lead / np.sum(fitness[: rivers + 1]) * streams)))
    mended = float(np.sum(np.round(lead / np.sum(lead) * streams)))
    return Recomputed(
        Printed(printed, half_unit(0) * (rivers + 1)),  # every share is rounded
        printed=Printed(float(streams), 0.0),
        mended=mended,
        population=population,
    )
