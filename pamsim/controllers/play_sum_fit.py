"""Prandtl-Ishlinskii operator of a measured loop: weights by non-negative least squares.

With its thresholds given, the output is linear in the weights, so that the fit is unique.
Weights that are not negative make an operator that lags and can be inverted (Kuhnen 2003).
"""

# scipy carries no types: what it returns is Any at this file's boundary.
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.optimize
from numpy.typing import ArrayLike, NDArray

from pamsim.core.errors import InputError
from pamsim.inference.record_checks import finite_samples
from pamsim.physics.hysteresis.play import play
from pamsim.physics.hysteresis.prandtl_ishlinskii import PlaySum

FloatArray = NDArray[np.float64]
_nnls: Any = scipy.optimize.nnls

_NOTHING = 1e-6  # of the sum of all weights: a play operator of smaller weight is dropped


@dataclass(frozen=True)
class PlaySumFit:
    """An operator and its error on the loop it was fitted to.

    Attributes:
        operator: with the plays that the data want.
        rms: root mean square of measured less fitted output [output unit].
    """

    operator: PlaySum
    rms: float


def identify_play_sum(
    input: ArrayLike,
    output: ArrayLike,
    *,
    plays: int = 12,
) -> PlaySumFit:
    """Fit the operator ``w_0 v + sum of w_k play(v; r_k)`` to a loop.

    Args:
        input: v, shape ``(n,)``, from a state in which every play is at 0; a decaying triangle
            shows every threshold [input unit].
        output: shape ``(n,)`` [output unit].
        plays: number of thresholds, evenly over the largest input.

    Returns:
        The operator and its error.

    Raises:
        InputError: shapes differ, an input that never moves, or an output that no operator with
            an inverse follows.
    """
    v, y = finite_samples(input, "input"), finite_samples(output, "output")
    if v.shape != y.shape:
        raise InputError(f"input has {v.size} samples, output {y.size}; give one for each")
    largest = float(np.max(np.abs(v)))
    if not largest > 0.0:
        raise InputError("the input stays at 0; give a loop, such as a decaying triangle")
    thresholds = [largest * (k + 0.5) / plays for k in range(plays)]
    columns = np.column_stack([v, *(_played(v, r) for r in thresholds)])
    weights, miss = _nnls(columns, y)
    total = float(np.sum(weights))
    if not weights[0] > _NOTHING * total:
        raise InputError(
            "the loop has no part that follows its input at once, so that its operator has no"
            " inverse; give fewer plays or a loop that reaches farther"
        )
    kept = [k for k in range(len(thresholds)) if weights[k + 1] > _NOTHING * total]
    operator = PlaySum(
        linear=float(weights[0]),
        thresholds=tuple(float(thresholds[k]) for k in kept),
        weights=tuple(float(weights[k + 1]) for k in kept),
    )
    return PlaySumFit(operator=operator, rms=float(miss) / float(np.sqrt(v.size)))


def _played(values: FloatArray, threshold: float) -> FloatArray:
    held, output = 0.0, np.empty_like(values)
    for k, x in enumerate(values.tolist()):
        output[k] = held = play(x, held, threshold)
    return output
