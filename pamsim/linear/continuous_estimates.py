"""From search coordinates to the user's parameters with intervals, and whether to trust them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pamsim.linear.continuous_structure import ContinuousStructure
from pamsim.linear.estimate import Estimate
from pamsim.linear.noise_weighted_fit import NoiseWeightedFit
from pamsim.linear.step_fit import FitStatus, Interval

FloatArray = NDArray[np.float64]

_VAGUE = 3.0  # factor up or down
_AT_BOUND = 1e-3  # distance from the bound of a logarithm


@dataclass(frozen=True, eq=False)
class Located:
    """An optimum in the structure's coordinates.

    Attributes:
        structure: what was fitted.
        coordinates: shape ``(k,)``.
        covariance: shape ``(k, k)``; None if the data do not determine them.
        quantile: half width of a 95 % interval in standard errors.
        latest_dead_time: upper end of the interval of a dead time that was found to be 0 and
            held there; None otherwise [s].
    """

    structure: ContinuousStructure
    coordinates: FloatArray
    covariance: FloatArray | None
    quantile: float
    latest_dead_time: float | None = None

    def width(self, gradient: FloatArray) -> float | None:
        """Return the half width of the 95 % interval of a function with this gradient."""
        if self.covariance is None:
            return None
        return self.quantile * float(np.sqrt(max(gradient @ self.covariance @ gradient, 0.0)))

    def unit(self, i: int) -> FloatArray:
        """Return the gradient of coordinate i, shape ``(k,)``."""
        result = np.zeros(self.coordinates.size)
        result[i] = 1.0
        return result


def continuous_estimates(at: Located, unit_gain: str) -> tuple[Estimate, ...]:
    """Return gain, time constants or (wn, zeta), zeros and dead time with 95 % intervals.

    Intervals of positive parameters are symmetric in the logarithm.

    Args:
        at: the optimum.
        unit_gain: output unit per input unit.

    Returns:
        ``K`` first.
    """
    structure, x = at.structure, at.coordinates
    first = structure.searched
    gain = float(x[first])
    result = [_plain("K", unit_gain, gain, at.width(at.unit(first)))]
    for name, unit, i in _pole_names(structure, x):
        log, half = float(x[i]), at.width(at.unit(i))
        sides = None
        if half is not None:
            with np.errstate(over="ignore"):
                sides = (float(np.exp(log - half)), float(np.exp(log + half)))
        result.append(Estimate(name, unit, float(np.exp(log)), sides))
    for power in range(1, structure.zeros + 1):
        name = "Tz" if structure.zeros == 1 else f"c{power}"
        ratio = float(x[first + power]) / gain
        gradient = (at.unit(first + power) - ratio * at.unit(first)) / gain
        result.append(_plain(name, "s" if power == 1 else f"s^{power}", ratio, at.width(gradient)))
    if structure.dead_time:
        delay, half = structure.delay(x), at.width(at.unit(structure.order))
        sides: Interval | None = None
        if at.latest_dead_time is not None:
            sides = (0.0, at.latest_dead_time)
        elif half is not None:
            sides = (max(delay - half, 0.0), delay + half)
        result.append(Estimate("L", "s", delay, sides))
    return tuple(result)


def judged(
    at: Located, fit: NoiseWeightedFit, shortest: float, longest: float
) -> tuple[FitStatus, str]:
    """Return whether to trust a continuous fit, and why.

    Args:
        at: the optimum.
        fit: how it was found.
        shortest: shortest sample time [s].
        longest: longest record [s].

    Returns:
        Status and sentence.
    """
    structure, x = at.structure, at.coordinates
    if not fit.solution.settled:
        return FitStatus.NOT_CONVERGED, "the solver ran out of evaluations before it settled"
    sizes = np.abs(structure.constants(x))
    if np.min(sizes) < shortest:
        return FitStatus.DEGENERATE, (
            f"time constant {np.min(sizes):.3g} s is shorter than one sample ({shortest:.3g} s): "
            "the records do not resolve it, lower the order"
        )
    if np.log(100.0 * longest) - np.log(np.max(sizes)) < _AT_BOUND:
        return FitStatus.AT_BOUND, (
            f"time constant {np.max(sizes):.3g} s is at its upper bound, a hundred records long: "
            "the output does not settle, or integrates"
        )
    if at.covariance is None:
        return FitStatus.DEGENERATE, "the Jacobian is singular: parameters cannot be told apart"
    first = structure.searched
    half = at.width(at.unit(first))
    if half is not None and abs(x[first]) < half:
        return FitStatus.DEGENERATE, (
            "the gain cannot be told from 0: the input explains nothing of the output, or the "
            "records are too short to show where it settles"
        )
    doubt = _merged(at) or _unresolved(at)
    if doubt:
        return FitStatus.DEGENERATE, doubt
    sentence = "converged inside the bounds"
    if at.latest_dead_time is not None:
        sentence += f"; no dead time is seen, it is below {at.latest_dead_time:.3g} s"
    if fit.disagreement is not None and not fit.weighted:
        sentence += (
            "; weighting by the noise model moves the estimates beyond their uncertainty, so the "
            "structure is wrong somewhere: kept are those that simulate best"
        )
    return FitStatus.CONVERGED, sentence


def _merged(at: Located) -> str:
    structure, x = at.structure, at.coordinates
    if not structure.real_lags:
        return ""
    rising = np.argsort(x[: structure.order], kind="stable")
    for low, high in pairwise(map(int, rising)):
        # The cost is even in d = log(T2/T1), so d^2 is the parameter with a regular estimate, and
        # its standard deviation is 2 d spread: two of them reach zero when d < 4 spread.
        width = at.width(at.unit(high) - at.unit(low))
        if width is not None and x[high] - x[low] < 4.0 * width / at.quantile:
            return (
                f"time constants {np.exp(x[low]):.3g} s and {np.exp(x[high]):.3g} s merge within "
                "their uncertainty: the records show a double lag or an oscillation; allow "
                "complex poles or lower the order"
            )
    return ""


def _unresolved(at: Located) -> str:
    structure, x = at.structure, at.coordinates
    for name, unit, i in _pole_names(structure, x):
        half = at.width(at.unit(i))
        if half is not None and half > np.log(_VAGUE):
            size = f"{np.exp(x[i]):.3g}" + ("" if unit == "-" else f" {unit}")
            return (
                f"{name} = {size} is known to no better than a factor of {_VAGUE:g}: more poles or "
                "zeros than the records show, lower the order"
            )
    return ""


def _pole_names(structure: ContinuousStructure, x: FloatArray) -> list[tuple[str, str, int]]:
    """Return name, unit and coordinate of each pole parameter; lags rise, pairs by rising wn."""
    pairs = sorted(range(structure.pairs), key=lambda pair: float(x[2 * pair]))
    number = [str(k + 1) if structure.pairs > 1 else "" for k in range(structure.pairs)]
    result: list[tuple[str, str, int]] = []
    for mark, pair in zip(number, pairs, strict=True):
        result += [(f"wn{mark}", "rad/s", 2 * pair), (f"zeta{mark}", "-", 2 * pair + 1)]
    lags = sorted(range(2 * structure.pairs, structure.order), key=lambda i: float(x[i]))
    for k, i in enumerate(lags):
        result.append((f"T{k + 1}" if len(lags) > 1 else "T", "s", i))
    return result


def _plain(name: str, unit: str, value: float, half: float | None) -> Estimate:
    sides = None if half is None else (value - half, value + half)
    return Estimate(name, unit, value, sides)
