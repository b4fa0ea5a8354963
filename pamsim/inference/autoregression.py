"""Loops of an autoregressive model over all samples: its prediction errors, and Burg's recursion.

They are compiled, and go through their arrays in chunks that stay in a processor's cache: with
numpy's passes over whole arrays, residuals of a million samples took most of the time of a fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.numba_cache import numba

_CHUNK = 1024  # samples: two arrays of them take half of a first-level cache
_compiled: Any = numba.njit(cache=True, nogil=True, error_model="numpy")
# Sums in any order, so that several samples are added at once.
_summing: Any = numba.njit(
    cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "contract"}
)


def filtered(predictor: FloatArray, values: FloatArray) -> FloatArray:
    """Return ``sum_k predictor[k] values[t - k]``, values before the first taken as 0.

    Args:
        predictor: shape ``(p + 1,)``.
        values: shape ``(n,)`` or ``(n, m)``; each column is filtered.
    """
    columns = values if values.ndim > 1 else values[:, np.newaxis]
    return _filtered(predictor, columns).reshape(values.shape)


def burg_reflections(rows: Sequence[FloatArray], most: int, limit: float) -> list[float]:
    """Return the reflection coefficients of orders 1 to ``most``, fewer where nothing is left.

    Args:
        rows: of shape ``(n_i,)``, each longer than ``most``.
        most: highest order.
        limit: of a coefficient's magnitude.

    Source: Burg's recursion (maximum entropy spectral analysis, 1967), numerator and denominator
    of each reflection summed over the rows.
    """
    ends = np.cumsum([0, *(row.size for row in rows)])
    return _burg(np.concatenate(rows).astype(np.float64, copy=False), ends, most, limit).tolist()


@_compiled
def _filtered(predictor: FloatArray, values: FloatArray) -> FloatArray:
    samples, count = values.shape
    reach = predictor.size - 1
    result = np.empty((samples, count))
    given, found = np.zeros(_CHUNK + reach), np.empty(_CHUNK)
    for column in range(count):
        given[:reach] = 0.0
        for first in range(0, samples, _CHUNK):
            size = min(_CHUNK, samples - first)
            for i in range(size):
                given[reach + i] = values[first + i, column]
            found[:] = 0.0
            for k in range(reach + 1):
                _add_multiple(found, predictor[k], given[reach - k : reach - k + _CHUNK])
            for i in range(size):
                result[first + i, column] = found[i]
            for i in range(reach):
                given[i] = given[size + i]
    return result


@_compiled
def _add_multiple(to: FloatArray, factor: float, values: FloatArray) -> None:
    for i in range(to.size):
        to[i] += factor * values[i]


@_compiled
def _burg(values: FloatArray, ends: Any, most: int, limit: float) -> FloatArray:
    # The backward error of order k at time t is kept at t - k, so that a step needs no shift.
    forward, backward = values, values.copy()
    reflections = np.empty(most)
    cross, power = 0.0, 0.0
    for row in range(ends.size - 1):
        own = values[ends[row] : ends[row + 1]]
        for first in range(0, own.size - 1, _CHUNK):
            last = min(first + _CHUNK, own.size - 1)
            both, squares = _products(own[first + 1 : last + 1], own[first:last])
            cross, power = cross + both, power + squares
    for order in range(1, most + 1):
        if not power > 0.0:
            return reflections[: order - 1]
        reflection = min(max(-2.0 * cross / power, -limit), limit)
        reflections[order - 1] = reflection
        cross, power = 0.0, 0.0
        for row in range(ends.size - 1):
            ahead = forward[ends[row] + order : ends[row + 1]]
            behind = backward[ends[row] : ends[row + 1] - order]
            for first in range(0, ahead.size, _CHUNK):
                last = min(first + _CHUNK, ahead.size)
                _step(ahead[first:last], behind[first:last], reflection)
                begin = max(first, 1)
                both, squares = _products(ahead[begin:last], behind[begin - 1 : last - 1])
                cross, power = cross + both, power + squares
    return reflections


@_compiled
def _step(ahead: FloatArray, behind: FloatArray, reflection: float) -> None:
    for i in range(ahead.size):
        before = ahead[i]
        ahead[i] = before + reflection * behind[i]
        behind[i] += reflection * before


@_summing
def _products(ahead: FloatArray, behind: FloatArray) -> tuple[float, float]:
    """Sum of the products, and that of both squares."""
    both, squares = 0.0, 0.0
    for i in range(ahead.size):
        both += ahead[i] * behind[i]
        squares += ahead[i] * ahead[i] + behind[i] * behind[i]
    return both, squares
