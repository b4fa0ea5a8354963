"""The triangular factor of tall matrices: all inner products of their columns, in a few rows."""

from __future__ import annotations

from typing import Any

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.numba_cache import numba

_PIECE = 128  # rows reduced at once: thirty columns of them stay in a first-level cache
# Sums in any order, so that several rows are added at once.
_compiled: Any = numba.njit(
    cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "contract"}
)


def triangular_factor(columns: FloatArray) -> FloatArray:
    """Return R of a QR decomposition of columns (n, k), shape ``(k, k)``.

    By Householder reflections of each piece of rows below the factor of those before. It is
    compiled: numpy copies all rows, which takes ten times as long.

    Source: TSQR (Demmel et al., SIAM Journal on Scientific Computing 34, 2012).
    """
    return _reduced(np.ascontiguousarray(columns))  # one layout, compiled once


@_compiled
def _reduced(columns: FloatArray) -> FloatArray:
    samples, count = columns.shape
    triangle, piece = np.zeros((count, count)), np.empty((count, _PIECE))
    for first in range(0, samples, _PIECE):
        size = min(_PIECE, samples - first)
        for i in range(size):
            for j in range(count):
                piece[j, i] = columns[first + i, j]
        for j in range(count):
            # The reflection changes row j of the factor and the piece, nothing else.
            own = piece[j, :size]
            square = _product(own, own)
            if square == 0.0:
                continue
            before = triangle[j, j]
            after = -np.copysign(np.sqrt(before**2 + square), before)
            triangle[j, j] = after
            share = 1.0 / (before - after)
            for k in range(j + 1, count):
                other = piece[k, :size]
                moved = (after - before) / after * (triangle[j, k] + share * _product(own, other))
                triangle[j, k] -= moved
                _add_multiple(other, -moved * share, own)
    return triangle


@_compiled
def _product(one: FloatArray, other: FloatArray) -> float:
    total = 0.0
    for i in range(one.size):
        total += one[i] * other[i]
    return total


@_compiled
def _add_multiple(to: FloatArray, factor: float, values: FloatArray) -> None:
    for i in range(to.size):
        to[i] += factor * values[i]
