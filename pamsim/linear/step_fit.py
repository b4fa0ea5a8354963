"""The result of a step-response fit: numbers, intervals, and whether to trust them."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pamsim.linear.first_second_order import first_order_step, second_order_step

FloatArray = NDArray[np.float64]
Interval = tuple[float, float]


class FitStatus(StrEnum):
    """How far the numbers of a fit can be trusted."""

    CONVERGED = "converged"
    AT_BOUND = "at_bound"
    NOT_CONVERGED = "not_converged"
    DEGENERATE = "degenerate"


@dataclass(frozen=True)
class StepFit:
    """A fitted ``K exp(-L s) / (T s + 1)`` or ``K exp(-L s) / ((T1 s + 1)(T2 s + 1))``.

    The 95 % intervals come from the Jacobian at the optimum and Student's t. They assume that the
    residuals are white and that the model order is right; residuals of a wrong order or of a
    sampled mechanism are strongly correlated (see ``residual_lag1``), and then the intervals are
    far too narrow. They are None where the parameter was held or the data do not determine it.

    Attributes:
        order: 1 or 2.
        gain: K [output unit per input unit].
        time_constants: (T,) or (T1, T2) with T1 <= T2 [s].
        dead_time: L, 0 unless it was freed [s].
        fit_percent: normalised RMS fit of the simulated step [%].
        rms: root mean square of the residual [output unit].
        interval95_gain: lower and upper end [output unit per input unit].
        interval95_time_constants: one (lower, upper) per time constant [s].
        interval95_dead_time: lower and upper end [s].
        residual_lag1: autocorrelation of the residual at one sample; near 0 if white [-].
        status: whether to trust the numbers.
        sentence: the same for a person.
        evaluations: model evaluations over all starts.
    """

    order: int
    gain: float
    time_constants: tuple[float, ...]
    dead_time: float
    fit_percent: float
    rms: float
    interval95_gain: Interval | None
    interval95_time_constants: tuple[Interval, ...] | None
    interval95_dead_time: Interval | None
    residual_lag1: float
    status: FitStatus
    sentence: str
    evaluations: int

    def response(self, time: ArrayLike, step_size: float = 1.0) -> FloatArray:
        """Simulate the fitted model for a step of ``step_size`` at t = 0.

        Args:
            time: times since the step, shape ``(n,)`` [s].
            step_size: height of the input step [input unit].

        Returns:
            The response, shape ``(n,)`` [output unit].
        """
        shifted = np.asarray(time, dtype=np.float64) - self.dead_time
        return self.gain * step_size * unit_step(shifted, self.time_constants)


def unit_step(time: FloatArray, constants: tuple[float, ...]) -> FloatArray:
    """Return the unit-gain step response of one lag (T,) or two (T1, T2), shape of ``time`` [-]."""
    if len(constants) == 1:
        return first_order_step(time, constants[0])
    return second_order_step(time, constants[0], constants[1])
