"""Free runs from an unknown start: what a model's initial state and a constant can add to them.

numpy and scipy only: the peers' environment has no pamsim.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.signal import lfilter

from pamsim.core.units import FloatArray

_LARGEST_GROWTH = 10.0


def grows(poles: ArrayLike, samples: int) -> bool:
    """Whether an unstable mode grows tenfold or more within a record: no start then fits a run.

    Args:
        poles: in the z plane, shape ``(n,)``.
        samples: of the record.
    """
    largest = max(float(np.max(np.abs(np.asarray(poles)))), 1.0)
    return bool(samples * np.log(largest) >= np.log(_LARGEST_GROWTH))


def free_responses(poles: ArrayLike, samples: int) -> FloatArray:
    """A constant, and all outputs that a linear system's initial state can cause.

    The free responses of a system of n poles are spanned by the first 1, 2, ... n stages of the
    cascade of its poles after one pulse. Each stage is a sample late, so that poles at 0 count and
    no column depends on the others: the i-th begins at sample i. Real parts are enough, since
    complex poles come in pairs.

    Args:
        poles: in the z plane, shape ``(n,)``, in any order.
        samples: N.

    Returns:
        Shape ``(N, 1 + n)``.
    """
    stage: NDArray[Any] = np.zeros(samples, dtype=complex)
    stage[0] = 1.0
    columns = [np.ones(samples)]
    for i, pole in enumerate(np.asarray(poles, dtype=complex)):
        stage = lfilter([1.0] if i == 0 else [0.0, 1.0], [1.0, -pole], stage)
        stage = stage / np.max(np.abs(stage))
        columns.append(stage.real)
    return np.column_stack(columns)


def started_freely(forced: FloatArray, poles: ArrayLike, measured: FloatArray) -> FloatArray:
    """The forced response plus the constant and initial state that least squares finds.

    Args:
        forced: output from rest, shape ``(N,)``.
        poles: of the model, in the z plane.
        measured: output, shape ``(N,)``.

    Returns:
        The free run, shape ``(N,)``; not finite if the model explodes within the record.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        columns = free_responses(poles, measured.size)
        missing = measured - forced
        if not (np.all(np.isfinite(columns)) and np.all(np.isfinite(missing))):
            return np.full(measured.size, np.inf)
    return forced + columns @ np.linalg.lstsq(columns, missing, rcond=None)[0]
