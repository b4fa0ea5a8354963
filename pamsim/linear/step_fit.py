"""Continuous-time fit of G1 or G2 to a sampled step response by output (simulation) error."""

# scipy carries no types: what it returns is Any at this file's boundary.
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false
# pyright: reportUnknownVariableType=false

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
import scipy.special
from numpy.typing import ArrayLike

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.inference.bounded_least_squares import Fit, bounded_least_squares, one_by_one
from pamsim.inference.coloured_noise import ArNoise
from pamsim.inference.record_checks import increasing_time, varying_output
from pamsim.inference.trial_noise import TrialNoise
from pamsim.linear.continuous_estimates import continuous_estimates, merged_lags
from pamsim.linear.continuous_structure import ContinuousStructure
from pamsim.linear.first_second_order import unit_step
from pamsim.linear.identified_model import FitStatus, IdentifiedModel, trial_score
from pamsim.linear.optimum import Optimum
from pamsim.linear.separable_fit import inverse_information

_student_quantile: Any = scipy.special.stdtrit

# Splits of the 63 % time into (T1, T2): G2 has a mirror-symmetric cost with a saddle at T1 = T2,
# so starts lie on one side of it, from well separated to nearly merged.
_STARTS: dict[int, tuple[tuple[float, ...], ...]] = {
    1: ((0.5,), (1.0,), (2.0,)),
    2: ((0.02, 1.0), (0.15, 0.85), (0.4, 0.6)),
}
_SINGULAR = 1e-6  # smallest over largest singular value of the column-scaled Jacobian


@dataclass(frozen=True)
class _Problem:
    """Scaled problem: x = [log T..., (L / reference time), (K / reference gain)]."""

    time: FloatArray
    target: FloatArray  # response over its final value
    structure: ContinuousStructure
    held_gain: float | None  # output unit per input unit
    reference_gain: float
    reference_time: float
    lower: FloatArray
    upper: FloatArray

    def unpack(self, x: FloatArray) -> tuple[tuple[float, ...], float, float]:
        """Return time constants [s], dead time [s], gain on the scaled axis [-]."""
        order = self.structure.order
        constants = tuple(float(v) for v in np.exp(x[:order]))
        delay = float(x[order]) * self.reference_time if self.structure.dead_time else 0.0
        held = self.held_gain
        return constants, delay, float(x[-1]) if held is None else held / self.reference_gain

    def residual(self, x: FloatArray) -> FloatArray:
        """Return simulated minus measured, shape ``(n,)`` [-]."""
        constants, delay, gain = self.unpack(x)
        return gain * unit_step(self.time - delay, constants) - self.target

    def optimum(self, x: FloatArray, covariance: FloatArray | None) -> Optimum:
        """Return x in the coordinates of the structure, with a zero row for a held gain."""
        scale = np.ones(x.size)
        if self.structure.dead_time:
            scale[self.structure.order] = self.reference_time
        if self.held_gain is None:
            scale[-1] = self.reference_gain
        coordinates = scale * x
        if covariance is not None:
            covariance = covariance * np.outer(scale, scale)
        if self.held_gain is not None:
            coordinates = np.append(coordinates, self.held_gain)
            covariance = None if covariance is None else np.pad(covariance, (0, 1))
        quantile = float(_student_quantile(self.time.size - x.size, 0.975))
        return Optimum(coordinates, covariance, quantile)


def _starts(problem: _Problem) -> list[FloatArray]:
    reference = problem.reference_time
    late = float(problem.time[np.argmax(np.abs(problem.target) >= 0.02)]) / reference
    delays: list[list[float]] = [[0.01], [0.8 * late]] if problem.structure.dead_time else [[]]
    gains: list[list[float]] = [[1.0]] if problem.held_gain is None else [[]]
    return [
        np.array([*np.log(np.array(split) * reference), *delay, *gain])
        for split, delay, gain in product(_STARTS[problem.structure.order], delays, gains)
    ]


def _status(problem: _Problem, solution: Fit, at: Optimum) -> tuple[FitStatus, str]:
    x = solution.x
    order = problem.structure.order
    shortest = float(np.exp(np.min(x[:order])))
    interval = float(np.median(np.diff(problem.time)))
    if not solution.converged:
        return FitStatus.NOT_CONVERGED, "the solver ran out of evaluations before it converged"
    # The cost is flat towards a vanishing lag, so the solver may stop short of the bound itself.
    near_upper = x > problem.upper - np.where(np.arange(x.size) < order, np.log(2.0), 1e-3)
    if np.min(x[:order]) < problem.lower[0] + np.log(2.0) or bool(np.any(near_upper)):
        return FitStatus.AT_BOUND, (
            "a parameter is at its bound: the record shows no such lag, or is too short for it"
        )
    if shortest < interval:
        return FitStatus.DEGENERATE, (
            f"time constant {shortest:.3g} s is shorter than one sample ({interval:.3g} s): "
            "the record does not resolve it"
        )
    if at.covariance is None:
        return FitStatus.DEGENERATE, "the Jacobian is singular: parameters are not identifiable"
    if merged_lags(problem.structure, at) is not None:
        return FitStatus.DEGENERATE, (
            "T1 and T2 merge within their uncertainty: the record shows a double lag or an "
            "oscillation, and does not determine two separate real lags"
        )
    return FitStatus.CONVERGED, "converged inside the bounds"


def fit_step(
    time: ArrayLike,
    response: ArrayLike,
    *,
    order: int,
    step_size: float = 1.0,
    gain: float | None = 1.0,
    dead_time: bool = False,
) -> IdentifiedModel:
    """Fit G1 or G2 to a step response by least squares on the simulated output.

    The step is taken to happen at ``time[0]`` with the output at rest at 0. Time constants are
    sought as logarithms between a tenth of a sample and a hundred record lengths, from several
    fixed starts; the best is kept, so that the result is reproducible.

    The 95 % intervals come from the Jacobian at the optimum and Student's t. They assume white
    residuals and the right model order. Residuals of a wrong order or of a sampled mechanism are
    strongly correlated (see ``residual_lag1`` of the trial), and then the intervals are far too
    narrow. They are None where the parameter was held or the data do not determine it.

    Args:
        time: increasing sample times, not necessarily uniform, shape ``(n,)`` [s].
        response: output relative to its value before the step, shape ``(n,)`` [output unit].
        order: 1 for G1, 2 for G2.
        step_size: height of the input step, not 0 [input unit].
        gain: K to hold (1.0 for a normalised response), or None to estimate it [output per input].
        dead_time: True estimates a dead time between 0 and half the record.

    Returns:
        The model with its status; do not quote the numbers unless that is ``converged``.

    Raises:
        InputError: bad order, step size or gain; short, constant, non-finite or unordered record;
            a response that ends where it began.

    Source: model of Matiskova 2021 (Appl. Sci. 2021, 11, 7288), equation (24); the paper itself
    names only ARX least squares, (25)-(29).
    """
    if order not in (1, 2):
        raise InputError(f"order = {order!r} is not known; give 1 for G1 or 2 for G2")
    if not (np.isfinite(step_size) and step_size != 0.0):
        raise InputError(f"step size {step_size!r} is no step; give the height of the input's step")
    if gain is not None and not (np.isfinite(gain) and gain != 0.0):
        raise InputError(f"held gain {gain!r} is not usable; give a finite non-zero value or None")
    t, y = increasing_time(time, response, minimum=8)
    varying_output(y)
    t = t - t[0]
    final = final_value(y)
    reached = np.flatnonzero(np.abs(y) >= 0.632 * abs(final))
    reference = max(float(t[reached[0]]), float(t[1]))

    low, high = np.log(float(np.median(np.diff(t))) / 10.0), np.log(100.0 * float(t[-1]))
    lower, upper = [low] * order, [high] * order
    if dead_time:
        lower, upper = [*lower, 0.0], [*upper, 0.5 * float(t[-1]) / reference]
    if gain is None:
        lower, upper = [*lower, -np.inf], [*upper, np.inf]
    structure = ContinuousStructure(order, dead_time=dead_time)
    problem = _Problem(
        time=t,
        target=y / final,
        structure=structure,
        held_gain=gain,
        reference_gain=final / step_size,
        reference_time=reference,
        lower=np.array(lower),
        upper=np.array(upper),
    )
    solution = bounded_least_squares(
        one_by_one(problem.residual),
        _starts(problem),
        lower=problem.lower,
        upper=problem.upper,
        jacobian="3-point",
        x_scale=1.0,
        tolerance=1e-12,
        gradient_tolerance=1e-12,
        max_steps=200,
    )
    square = solution.cost
    variance = square / (t.size - solution.x.size)
    inverse = inverse_information(solution.jacobian, _SINGULAR)
    covariance = None if inverse is None else variance * inverse
    at = problem.optimum(solution.x, covariance)
    status, sentence = _status(problem, solution, at)
    if status not in (FitStatus.CONVERGED, FitStatus.DEGENERATE):
        at = replace(at, covariance=None)
    score = trial_score("step", y, y + solution.residual * final)
    # Of a perfect match only rounding remains, whose correlation means nothing.
    if status is FitStatus.CONVERGED and score.residual_lag1 > 0.5 and square > 1e-20 * t.size:
        sentence += (
            f"; residuals are correlated (lag 1: {score.residual_lag1:.2f}), the intervals are too"
            " narrow"
        )
    estimates = continuous_estimates(structure, at, "-", ("-",), {})
    if gain is not None:
        estimates = (replace(estimates[0], interval95=None), *estimates[1:])
    return IdentifiedModel(
        structure=structure,
        coordinates=at.coordinates,
        covariance=at.covariance,
        quantile=at.quantile,
        estimates=estimates,
        trials=(score,),
        fit_percent=score.fit_percent,
        noise=TrialNoise((ArNoise((), variance * final**2),)),
        status=status,
        sentence=sentence,
        evaluations=solution.evaluations,
    )


def final_value(response: FloatArray) -> float:
    """Return the mean of the last 2 % of the samples (at least one).

    Args:
        response: samples, shape ``(n,)`` [output unit].

    Returns:
        The final value [output unit].

    Raises:
        InputError: the final value is zero against the record's largest excursion.
    """
    count = max(1, response.size // 50)
    final = float(np.mean(response[-count:]))
    if abs(final) < 1e-3 * float(np.max(np.abs(response))):
        raise InputError(
            f"response ends where it began (final value {final:g}, mean of the last {count} "
            "samples): G1 and G2 describe a lasting step; cut the record before the return"
        )
    return final
