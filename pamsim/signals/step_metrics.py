"""What a control engineer reads off a step response: rest value, settling, overshoot, reversals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True, kw_only=True)
class StepMetrics:
    """Figures of one step response, in the units of the response.

    Attributes:
        start: first value.
        final: mean over the last 2 % of the record.
        settling_time: from when on the response stays within 2 % of its travel of the final value
            [s]; NaN if it has not settled by the last tenth of the record.
        overshoot: largest travel beyond the final value, as a share of the travel [-].
        reversal: largest turn back against the direction of the step.
    """

    start: float
    final: float
    settling_time: float
    overshoot: float
    reversal: float

    def monotonic(self, tolerance: float) -> bool:
        """Whether the response never turns back by more than a tolerance, in its own units."""
        return self.reversal <= tolerance


def step_metrics(time: ArrayLike, response: ArrayLike) -> StepMetrics:
    """Read the figures off a step response.

    Args:
        time: (n,) [s], increasing from the step on.
        response: (n,) in any unit.

    Returns:
        The figures; a response without travel has no overshoot and settles at once.
    """
    t = np.asarray(time, dtype=float)
    y = np.asarray(response, dtype=float)
    final = float(y[-max(1, len(y) // 50) :].mean())
    start = float(y[0])
    travel = final - start
    if travel == 0.0:
        return StepMetrics(
            start=start, final=final, settling_time=0.0, overshoot=0.0, reversal=float(np.ptp(y))
        )
    forward = (y - start) * np.sign(travel)
    outside = np.flatnonzero(np.abs(y - final) > 0.02 * abs(travel))
    last = int(outside[-1]) + 1 if len(outside) else 0
    return StepMetrics(
        start=start,
        final=final,
        settling_time=float(t[last]) if last < 0.9 * len(t) else float("nan"),
        overshoot=max(0.0, float(forward.max() / abs(travel)) - 1.0),
        reversal=_largest_drop(forward),
    )


def _largest_drop(forward: NDArray[np.float64]) -> float:
    return float(np.max(np.maximum.accumulate(forward) - forward))
