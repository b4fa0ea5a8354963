"""Exact sampled response of a chain of lags to a held input, with any fraction of a sample delay.

The chain ``x_i' = (x_(i-1) - x_i) / T_i``, ``x_0 = u``, has the output ``1/D(s) u`` with
``D = (T_1 s + 1)...(T_n s + 1)`` in its last state. Pairs of conjugate T make oscillating models;
integrators ``x_i' = x_(i-1)`` may follow. Unlike partial fractions it needs no case of its own
where time constants meet.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamsim.core.units import FloatArray
from pamsim.numba_cache import numba

_TERMS = 15  # of the exponential, of a norm below 1/2: less than rounding is left
_compiled: Any = numba.njit(cache=True, nogil=True, error_model="numpy")


def chain_derivatives(
    constants: NDArray[Any],
    given: FloatArray,
    sample_time: float,
    *,
    count: int,
    dead_time: float = 0.0,
    hold: str = "zoh",
    integrators: int = 0,
) -> FloatArray:
    """Return ``s^k exp(-L s) / (s^q D(s)) u`` for k = 0..count-1, from rest.

    Args:
        constants: T_1..T_n, real or in conjugate pairs, shape ``(n,)``, real parts > 0 [s].
        given: u at the samples, shape ``(N,)``; before them u = u[0] = 0 is taken [input unit].
        sample_time: Ts [s].
        count: number of derivatives, at most ``n + q + 1``; the last of so many contains u itself.
        dead_time: L; slightly negative looks ahead [s].
        hold: ``zoh`` (u constant between samples) or ``foh`` (straight lines).
        integrators: q.

    Returns:
        Shape ``(N, count)`` [input unit / s^k].

    Source: variation of constants over each sample, in two pieces because a delayed input's knots
    lie inside it; exponential of the chain augmented by its input and the input's slope (Van Loan
    1978).
    """
    whole = int(np.floor(dead_time / sample_time))
    part = dead_time / sample_time - whole
    now, old = _late(given, whole), _late(given, whole + 1)
    pieces = part * sample_time, (1.0 - part) * sample_time
    if hold == "zoh":
        level = now if part == 0.0 else old
        return _derivatives(
            constants, integrators, count, pieces, False, level, np.empty(0), now - level
        )
    rising = (now - old) / sample_time
    bend = (_late(given, whole - 1) - now) / sample_time - rising
    level = now - part * (now - old)
    return _derivatives(constants, integrators, count, pieces, False, level, rising, bend)


def chain_modes(constants: NDArray[Any], samples: int, sample_time: float) -> FloatArray:
    """Return n independent free responses of the chain: its impulse response and derivatives.

    Columns of length N, each with a largest value of 1 [-].
    """
    count = constants.size
    if count == 0:
        return np.empty((samples, 0))
    still, pieces = np.zeros(samples), (0.0, sample_time)
    modes = _derivatives(constants, 0, count, pieces, True, still, np.empty(0), still)
    largest = np.max(np.abs(modes), axis=0)
    return modes / np.where(largest > 0.0, largest, 1.0)


def _late(values: FloatArray, samples: int) -> FloatArray:
    """Shift by whole samples; what moves in is the first value, or the last if negative."""
    if samples == 0:
        return values
    if samples < 0:
        return np.concatenate([values[-samples:], np.full(-samples, values[-1])])
    count = min(samples, values.size)
    return np.concatenate([np.full(count, values[0]), values[: values.size - count]])


@_compiled
def _system(constants: Any, integrators: int) -> Any:
    """Matrix of the chain, its input and the input's slope as one system without input."""
    n = constants.size + integrators
    matrix = np.zeros((n + 2, n + 2), dtype=constants.dtype)
    for i in range(n):
        rate = 1.0 / constants[i] if i < constants.size else 1.0
        matrix[i, i - 1 if i else n] = rate
        if i < constants.size:
            matrix[i, i] = -rate
    matrix[n, n + 1] = 1.0
    return matrix


@_compiled
def _exponential(matrix: Any) -> Any:
    """Exponential of a few by few matrix, by Taylor series, scaling and squaring."""
    norm = 0.0
    for row in matrix:
        norm = max(norm, np.sum(np.abs(row)))
    squarings = max(0, int(np.ceil(np.log2(max(2.0 * norm, 1.0)))))
    small = matrix / 2.0**squarings
    result = np.zeros_like(matrix)
    # Horner's scheme.
    for k in range(_TERMS, -1, -1):
        result = _product(small, result) / (k + 1.0)
        for i in range(matrix.shape[0]):
            result[i, i] += 1.0
    for _ in range(squarings):
        result = _product(result, result)
    return result


@_compiled
def _product(left: Any, right: Any) -> Any:
    """Product of two small square matrices, without BLAS."""
    size = left.shape[0]
    result = np.zeros_like(left)
    for i in range(size):
        for k in range(size):
            for j in range(size):
                result[i, j] += left[i, k] * right[k, j]
    return result


@_compiled
def _derivatives(
    constants: Any,
    integrators: int,
    count: int,
    pieces: tuple[float, float],
    kicked: bool,
    level: FloatArray,
    rising: FloatArray,
    change: FloatArray,
) -> FloatArray:
    """Derivatives of the last state, from rest or after an impulse.

    The input's knots divide each step in two pieces. Level and slope (empty of a held input) are
    those at the start of each step; at the knot the level changes, or the slope if there is one.
    """
    system = _system(constants, integrators)
    n, slope = system.shape[0] - 2, int(rising.size > 0)
    after = _exponential(system * pieces[1])
    whole = _product(after, _exponential(system * pieces[0]))
    rows = np.zeros((count, n + 2), dtype=system.dtype)
    rows[0, n - 1 if n else n] = 1.0
    for k in range(1, count):
        for i in range(n + 1):
            for j in range(n + 2):
                rows[k, j] += rows[k - 1, i] * system[i, j]
    held, sloped, changed = (
        whole[:n, n].copy(),
        whole[:n, n + 1].copy(),
        after[:n, n + slope].copy(),
    )
    result = np.empty((level.size, count))
    state, following = np.zeros(n, dtype=system.dtype), np.zeros(n, dtype=system.dtype)
    if kicked:
        state[:] = system[:n, n]
    for k in range(level.size):
        for c in range(count):
            value = rows[c, n] * level[k]
            for i in range(n):
                value += rows[c, i] * state[i]
            result[k, c] = value.real
        for i in range(n):
            value = held[i] * level[k] + changed[i] * change[k]
            if slope:
                value += sloped[i] * rising[k]
            for j in range(i + 1):
                value += whole[i, j] * state[j]
            following[i] = value
        state[:] = following
    return result
