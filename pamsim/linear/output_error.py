"""Continuous-time fit of G1 or G2 to a sampled step response by output (simulation) error."""

# scipy carries no types: what it returns is Any at this file's boundary.
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false
# pyright: reportUnknownVariableType=false

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import scipy.optimize
import scipy.special
from numpy.typing import ArrayLike, NDArray

from pamsim.core.errors import InputError
from pamsim.inference.record_checks import increasing_time, varying_output
from pamsim.linear.fit_percent import fit_percent
from pamsim.linear.step_fit import FitStatus, Interval, StepFit, unit_step

FloatArray = NDArray[np.float64]
_least_squares: Any = scipy.optimize.least_squares
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
    """Scaled problem: x = [log T..., (K / reference gain), (L / reference time)]."""

    time: FloatArray
    target: FloatArray  # response over its final value
    order: int
    held_gain: float | None  # on the scaled axis
    free_dead_time: bool
    reference_time: float
    lower: FloatArray
    upper: FloatArray

    def unpack(self, x: FloatArray) -> tuple[tuple[float, ...], float, float]:
        """Return time constants [s], gain on the scaled axis [-], dead time [s]."""
        constants = tuple(float(v) for v in np.exp(x[: self.order]))
        rest = list(x[self.order :])
        gain = self.held_gain if self.held_gain is not None else float(rest.pop(0))
        return constants, gain, float(rest[0]) * self.reference_time if rest else 0.0

    def residual(self, x: FloatArray) -> FloatArray:
        """Return simulated minus measured, shape ``(n,)`` [-]."""
        constants, gain, dead_time = self.unpack(x)
        return gain * unit_step(self.time - dead_time, constants) - self.target


def _starts(problem: _Problem) -> list[FloatArray]:
    reference = problem.reference_time
    late = float(problem.time[np.argmax(np.abs(problem.target) >= 0.02)]) / reference
    gains: list[list[float]] = [[1.0]] if problem.held_gain is None else [[]]
    delays: list[list[float]] = [[0.01], [0.8 * late]] if problem.free_dead_time else [[]]
    result: list[FloatArray] = []
    for split, gain, delay in product(_STARTS[problem.order], gains, delays):
        x = np.array([*np.log(np.array(split) * reference), *gain, *delay])
        # least_squares wants its start strictly inside the bounds.
        result.append(np.clip(x, problem.lower + 1e-6, problem.upper - 1e-6))
    return result


def _best(problem: _Problem) -> tuple[Any, int]:
    count = 0

    def counted(x: FloatArray) -> FloatArray:
        nonlocal count
        count += 1
        return problem.residual(x)

    best: Any = None
    for start in _starts(problem):
        solution = _least_squares(
            counted,
            start,
            jac="3-point",
            bounds=(problem.lower, problem.upper),
            ftol=1e-12,
            xtol=1e-12,
            gtol=1e-12,
            max_nfev=200,
        )
        if best is None or solution.cost < best.cost:
            best = solution
    return best, count


def _covariance(jacobian: FloatArray, variance: float) -> FloatArray | None:
    norms = np.linalg.norm(jacobian, axis=0)
    if np.any(norms == 0.0):
        return None
    _, singular, vt = np.linalg.svd(jacobian / norms, full_matrices=False)
    if singular[-1] < _SINGULAR * singular[0]:
        return None
    half = vt.T / singular / norms[:, np.newaxis]
    return variance * (half @ half.T)


def _judge(
    problem: _Problem, solution: Any, covariance: FloatArray | None
) -> tuple[FitStatus, str]:
    x: FloatArray = solution.x
    logs = np.sort(x[: problem.order])
    interval = float(np.median(np.diff(problem.time)))
    if solution.status <= 0:
        return FitStatus.NOT_CONVERGED, "the solver ran out of evaluations before it settled"
    # The cost is flat towards a vanishing lag, so the solver may stop short of the bound itself.
    near_upper = x > problem.upper - np.where(np.arange(x.size) < problem.order, np.log(2.0), 1e-3)
    if logs[0] < problem.lower[0] + np.log(2.0) or bool(np.any(near_upper)):
        return FitStatus.AT_BOUND, (
            "a parameter ran into its bound: the record holds no such lag, or is too short for it"
        )
    if np.exp(logs[0]) < interval:
        return FitStatus.DEGENERATE, (
            f"time constant {np.exp(logs[0]):.3g} s is shorter than one sample ({interval:.3g} s): "
            "the record does not resolve it"
        )
    if covariance is None:
        return FitStatus.DEGENERATE, "the Jacobian is singular: parameters cannot be told apart"
    if problem.order == 2:
        difference = np.array([1.0, -1.0])
        spread = float(np.sqrt(difference @ covariance[:2, :2] @ difference))
        # The cost is even in d = log(T2/T1), so d^2 is the parameter with a regular estimate, and
        # its standard deviation is 2 d spread: two of them reach zero when d < 4 spread.
        if logs[1] - logs[0] < 4.0 * spread:
            return FitStatus.DEGENERATE, (
                "T1 and T2 merge within their uncertainty: the record shows a double lag or an "
                "oscillation, two separate real lags cannot be told from it"
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
) -> StepFit:
    """Fit G1 or G2 to a step response by least squares on the simulated output.

    The step is taken to happen at ``time[0]`` with the output at rest at 0. Time constants are
    sought as logarithms between a tenth of a sample and a hundred record lengths, from several
    fixed starts; the best is kept, so that the result does not depend on chance.

    Args:
        time: increasing sample times, not necessarily uniform, shape ``(n,)`` [s].
        response: output relative to its value before the step, shape ``(n,)`` [output unit].
        order: 1 for G1, 2 for G2.
        step_size: height of the input step, not 0 [input unit].
        gain: K to hold (1.0 for a normalised response), or None to estimate it [output per input].
        dead_time: True estimates a dead time between 0 and half the record.

    Returns:
        The fit with its status; a status other than ``converged`` means: do not quote the numbers.

    Raises:
        InputError: bad order, step size or gain; short, constant, non-finite or unordered record;
            a response that ends where it began.

    Source: model of Matiskova 2021, equation (24); the paper itself names
    only ARX least squares, (25)-(29).
    """
    if order not in (1, 2):
        raise InputError(f"order = {order!r} is not known; give 1 for G1 or 2 for G2")
    if not (np.isfinite(step_size) and step_size != 0.0):
        raise InputError(f"step size {step_size!r}: there is no step in the input; give its height")
    if gain is not None and not (np.isfinite(gain) and gain != 0.0):
        raise InputError(f"held gain {gain!r} is not usable; give a finite non-zero value or None")
    t, y = increasing_time(time, response, minimum=8)
    varying_output(y)
    t = t - t[0]
    final = final_value(y)
    reached = np.flatnonzero(np.abs(y) >= 0.632 * abs(final))
    reference = max(float(t[reached[0]]), float(t[1]))
    unit = final / step_size

    low, high = np.log(float(np.median(np.diff(t))) / 10.0), np.log(100.0 * float(t[-1]))
    lower, upper = [low] * order, [high] * order
    if gain is None:
        lower, upper = [*lower, -np.inf], [*upper, np.inf]
    if dead_time:
        lower, upper = [*lower, 0.0], [*upper, 0.5 * float(t[-1]) / reference]
    held = None if gain is None else gain / unit
    problem = _Problem(
        t, y / final, order, held, dead_time, reference, np.array(lower), np.array(upper)
    )
    solution, evaluations = _best(problem)

    residual: FloatArray = solution.fun
    square = float(residual @ residual)
    freedom = t.size - solution.x.size
    covariance = _covariance(solution.jac, square / freedom)
    status, sentence = _judge(problem, solution, covariance)
    constants, scaled_gain, delay = problem.unpack(solution.x)
    lag1 = float(residual[1:] @ residual[:-1]) / square if square > 0.0 else 0.0
    # Of a perfect match only rounding is left, whose correlation says nothing.
    if status is FitStatus.CONVERGED and lag1 > 0.5 and square > 1e-20 * t.size:
        sentence += f"; residuals are correlated (lag 1: {lag1:.2f}), the intervals are too narrow"

    half: FloatArray | None = None
    if covariance is not None and status in (FitStatus.CONVERGED, FitStatus.DEGENERATE):
        half = float(_student_quantile(freedom, 0.975)) * np.sqrt(np.diag(covariance))
    sides = _intervals(problem, solution.x, half, unit)
    return StepFit(
        order=order,
        gain=scaled_gain * unit if gain is None else float(gain),
        time_constants=tuple(sorted(constants)),
        dead_time=delay,
        fit_percent=fit_percent(y, y + residual * final),
        rms=abs(final) * float(np.sqrt(square / t.size)),
        interval95_gain=sides[0],
        interval95_time_constants=sides[1],
        interval95_dead_time=sides[2],
        residual_lag1=lag1,
        status=status,
        sentence=sentence,
        evaluations=evaluations,
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


def _intervals(
    problem: _Problem, x: FloatArray, half: FloatArray | None, unit: float
) -> tuple[Interval | None, tuple[Interval, ...] | None, Interval | None]:
    """Turn half widths on the scaled axes into intervals of gain, time constants, dead time."""
    if half is None:
        return None, None, None

    def across(i: int, scale: float) -> Interval:
        ends = scale * float(x[i] - half[i]), scale * float(x[i] + half[i])
        return min(ends), max(ends)

    n = problem.order
    # Time constants are positive: their interval is symmetric in the logarithm.
    with np.errstate(over="ignore"):
        logs = [np.exp([x[i] - half[i], x[i] + half[i]]) for i in np.argsort(x[:n])]
    constants = tuple((float(pair[0]), float(pair[1])) for pair in logs)
    free_gain = problem.held_gain is None
    gain = across(n, unit) if free_gain else None
    delay = None
    if problem.free_dead_time:
        low, high = across(n + int(free_gain), problem.reference_time)
        delay = (max(low, 0.0), high)
    return gain, constants, delay
