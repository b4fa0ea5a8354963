"""From search coordinates to the user's parameters with intervals, and whether to trust them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.inference.estimate import Estimate, Interval
from pamsim.linear.continuous_structure import ContinuousStructure
from pamsim.linear.identified_model import FitStatus
from pamsim.linear.noise_weighted_fit import NoiseWeightedFit
from pamsim.linear.optimum import Optimum

_VAGUE = 3.0  # factor up or down
_AT_BOUND = 1e-3  # distance from the bound of a logarithm


def continuous_estimates(
    structure: ContinuousStructure,
    at: Optimum,
    unit_output: str,
    units_input: Sequence[str],
    latest_dead_times: Mapping[int, float],
) -> tuple[Estimate, ...]:
    """Return gain, time constants or (wn, zeta), zeros and dead time with 95 % intervals.

    Of several inputs K, zeros and dead time carry the input's number: ``K[1]``. Of an integrating
    model K is the gain from the input to the output's rate (or its rate), and ``u0`` the input at
    which the output does not run away; of several inputs ``r0`` is that rate where all are 0.

    Intervals of positive parameters are symmetric in the logarithm.

    Args:
        structure: what was fitted.
        at: the optimum.
        unit_output: of the output.
        units_input: of each input.
        latest_dead_times: of inputs whose dead time was estimated as 0 and held there: upper end
            of its interval [s].

    Returns:
        ``K`` first.
    """
    x = at.coordinates
    numbers = [f"[{i + 1}]" for i in range(structure.inputs)] if structure.inputs > 1 else [""]
    firsts = [structure.coefficients(i).start for i in range(structure.inputs)]
    per_time = ("", "/s", "/s^2")[structure.integrators]
    result: list[Estimate] = []
    for number, first, unit in zip(numbers, firsts, units_input, strict=True):
        ratio = "-" if unit_output == unit == "-" else f"{unit_output}/{unit}"
        unit_gain = ratio + per_time
        result.append(at.estimate(f"K{number}", unit_gain, float(x[first]), at.unit(first)))
    for name, unit, i in _pole_names(structure, x):
        result.append(at.estimate(name, unit, float(np.exp(x[i])), at.unit(i), positive=True))
    for number, first, zeros in zip(numbers, firsts, structure.numerator_zeros, strict=True):
        gain = float(x[first])
        for power in range(1, zeros + 1):
            name = "Tz" if zeros == 1 else f"c{power}"
            ratio = float(x[first + power]) / gain
            gradient = (at.unit(first + power) - ratio * at.unit(first)) / gain
            unit = "s" if power == 1 else f"s^{power}"
            result.append(at.estimate(name + number, unit, ratio, gradient))
    if structure.biased:
        result.append(_bias(structure, at, unit_output, units_input))
    delays = structure.delays(x)
    for place, i in enumerate(structure.delayed, start=structure.order):
        delay, half = float(delays[i]), at.half_width(at.unit(place))
        sides: Interval | None = None
        if i in latest_dead_times:
            sides = (0.0, latest_dead_times[i])
        elif half is not None:
            sides = (max(delay - half, 0.0), delay + half)
        result.append(Estimate(name=f"L{numbers[i]}", unit="s", value=delay, interval95=sides))
    return tuple(result)


def _bias(
    structure: ContinuousStructure, at: Optimum, unit_output: str, units_input: Sequence[str]
) -> Estimate:
    x, last = at.coordinates, at.coordinates.size - 1
    if structure.inputs > 1:
        per_time = ("", "/s", "/s^2")[structure.integrators]
        return at.estimate("r0", unit_output + per_time, float(x[last]), at.unit(last))
    first = structure.coefficients().start
    gain = float(x[first])
    rest = -float(x[last]) / gain
    gradient = -(at.unit(last) + rest * at.unit(first)) / gain
    return at.estimate("u0", units_input[0], rest, gradient)


def continuous_status(
    structure: ContinuousStructure,
    at: Optimum,
    fit: NoiseWeightedFit,
    shortest: float,
    longest: float,
    latest_dead_times: Mapping[int, float],
) -> tuple[FitStatus, str]:
    """Return whether to trust a continuous fit, and why.

    Args:
        structure: what was fitted.
        at: the optimum.
        fit: of its coordinates.
        shortest: shortest sample time [s].
        longest: longest record [s].
        latest_dead_times: as in `continuous_estimates`.

    Returns:
        Status and sentence.
    """
    x = at.coordinates
    if not fit.solution.settled:
        return FitStatus.NOT_CONVERGED, "the solver ran out of evaluations before it converged"
    constants = structure.constants(x)
    sizes = np.abs(constants)
    # An oscillation is resolved up to half the sampling rate.
    resolved = np.where(np.imag(constants) == 0.0, shortest, shortest / np.pi)
    if np.any(sizes < resolved):
        return FitStatus.DEGENERATE, (
            f"time constant {np.min(sizes):.3g} s is shorter than one sample ({shortest:.3g} s): "
            "the records do not resolve it, lower the order"
        )
    if sizes.size and np.log(100.0 * longest) - np.log(np.max(sizes)) < _AT_BOUND:
        return FitStatus.AT_BOUND, (
            f"time constant {np.max(sizes):.3g} s is at its upper bound, a hundred records long: "
            "the output does not settle, or integrates"
        )
    if at.covariance is None:
        return FitStatus.DEGENERATE, "the Jacobian is singular: parameters are not identifiable"
    each = [structure.coefficients(i) for i in range(structure.inputs)]
    if structure.integrators and all(_contains_zero(at, places.start) for places in each):
        return FitStatus.DEGENERATE, (
            "the interval of the gain contains 0, so that a zero cancels an integrator: the records"
            " do not show that the output integrates"
        )
    if structure.integrators and all(
        np.any(np.abs(np.roots(x[places][::-1])) * longest < 1.0) for places in each
    ):
        return FitStatus.DEGENERATE, (
            "a zero slower than the longest record cancels an integrator: the records do not show "
            "that the output integrates so often"
        )
    idle = [i for i, places in enumerate(each, start=1) if _numerator_may_be_zero(at, places)]
    if len(idle) == structure.inputs:
        return FitStatus.DEGENERATE, (
            "the interval of the gain contains 0: the input explains nothing of the output, or "
            "the records are too short to show where it settles"
        )
    pair = merged_lags(structure, at)
    if pair is not None:
        return FitStatus.DEGENERATE, (
            f"time constants {pair[0]:.3g} s and {pair[1]:.3g} s merge within "
            "their uncertainty: the records show a double lag or an oscillation; allow "
            "complex poles or lower the order"
        )
    vague = _vague_parameter(structure, at)
    if vague:
        return FitStatus.DEGENERATE, (
            f"{vague} is known to no better than a factor of {_VAGUE:g}: more poles or "
            "zeros than the records show, lower the order"
        )
    sentence = "converged inside the bounds"
    for i in idle:
        sentence += f"; input {i} explains nothing of the output, its gain may be 0"
    for i, latest in latest_dead_times.items():
        of = f" of input {i + 1}" if structure.inputs > 1 else ""
        sentence += f"; no dead time{of} is detected, it is below {latest:.3g} s"
    if fit.disagreement is not None and not fit.weighted:
        sentence += (
            "; weighting by the noise model moves the estimates too far, so the "
            "structure is wrong somewhere: the estimates that simulate best are kept"
        )
    return FitStatus.CONVERGED, sentence


def _contains_zero(at: Optimum, i: int) -> bool:
    half = at.half_width(at.unit(i))
    return half is not None and abs(float(at.coordinates[i])) < half


def _numerator_may_be_zero(at: Optimum, places: slice) -> bool:
    """Whether all coefficients together are within their uncertainty of 0 (Wald's test)."""
    if at.covariance is None:
        return False
    b = at.coordinates[places]
    solved: Any = np.linalg.lstsq(at.covariance[places, places], b, rcond=None)[0]
    # The square of the quantile is that of one coefficient; of several the sum must be larger.
    return float(b @ solved) < at.quantile**2 * b.size


def merged_lags(structure: ContinuousStructure, at: Optimum) -> tuple[float, float] | None:
    """Return two real time constants that the data do not separate, or None [s]."""
    if not structure.real_lags:
        return None
    x = at.coordinates
    rising = np.argsort(x[: structure.order], kind="stable")
    for low, high in pairwise(map(int, rising)):
        # The cost is even in d = log(T2/T1), so d^2 is the parameter with a regular estimate, and
        # its standard deviation is 2 d spread: two of them reach zero when d < 4 spread.
        half = at.half_width(at.unit(high) - at.unit(low))
        if half is not None and x[high] - x[low] < 4.0 * half / at.quantile:
            return float(np.exp(x[low])), float(np.exp(x[high]))
    return None


def _vague_parameter(structure: ContinuousStructure, at: Optimum) -> str:
    """Return the first pole parameter with too wide an interval, with its value; or nothing."""
    for name, unit, i in _pole_names(structure, at.coordinates):
        half = at.half_width(at.unit(i))
        if half is not None and half > np.log(_VAGUE):
            value = f"{name} = {np.exp(at.coordinates[i]):.3g}"
            return value if unit == "-" else f"{value} {unit}"
    return ""


def _pole_names(structure: ContinuousStructure, x: FloatArray) -> list[tuple[str, str, int]]:
    """Return name, unit and coordinate of each pole parameter; lags rise, pairs by rising wn."""
    pairs = sorted(range(structure.pairs), key=lambda pair: float(x[2 * pair]))
    number = [str(k + 1) if structure.pairs > 1 else "" for k in range(structure.pairs)]
    result: list[tuple[str, str, int]] = []
    for suffix, pair in zip(number, pairs, strict=True):
        result += [(f"wn{suffix}", "rad/s", 2 * pair), (f"zeta{suffix}", "-", 2 * pair + 1)]
    lags = sorted(range(2 * structure.pairs, structure.order), key=lambda i: float(x[i]))
    for k, i in enumerate(lags):
        result.append((f"T{k + 1}" if len(lags) > 1 else "T", "s", i))
    return result
