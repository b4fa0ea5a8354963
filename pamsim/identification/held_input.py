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
_GONE = 1e-30
"""Size of a free state over its largest, below which nothing of it is left in any derivative: long
records go on for thousands of time constants."""
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
    if hold == "zoh":
        start, rising = old, np.empty(0)
        now_rising, direct = rising, now if part == 0.0 else old
    else:
        rising = (now - old) / sample_time
        now_rising = (_late(given, whole - 1) - now) / sample_time
        start = direct = now - part * (now - old)
    pieces = part * sample_time, (1.0 - part) * sample_time
    return _derivatives(
        constants, integrators, count, pieces, False, start, now, rising, now_rising, direct
    )


def chain_modes(constants: NDArray[Any], samples: int, sample_time: float) -> FloatArray:
    """Return n independent free responses of the chain: its impulse response and derivatives.

    Columns of length N, each with a largest value of 1 [-].
    """
    count = constants.size
    if count == 0:
        return np.empty((samples, 0))
    still, none = np.zeros(samples), np.empty(0)
    pieces = 0.0, sample_time
    modes = _derivatives(constants, 0, count, pieces, True, still, still, none, none, still)
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
def _chain(constants: Any, integrators: int) -> Any:
    """State matrix of the chain, and how its input enters."""
    n = constants.size + integrators
    chain, entry = np.zeros((n, n), dtype=constants.dtype), np.zeros(n, dtype=constants.dtype)
    for i in range(n):
        if i:
            chain[i, i - 1] = 1.0
        else:
            entry[i] = 1.0
        if i < constants.size:
            rate = 1.0 / constants[i]
            chain[i, : i + 1] *= rate
            chain[i, i] = -rate
            entry[i] *= rate
    return chain, entry


@_compiled
def _exponential(matrix: Any) -> Any:
    """Exponential of a few by few matrix, by Taylor series, scaling and squaring."""
    norm = np.max(np.sum(np.abs(matrix), axis=1))
    squarings = max(0, int(np.ceil(np.log2(max(2.0 * norm, 1.0)))))
    small = matrix / 2.0**squarings
    # Horner's scheme; with a norm of at most 1/2, 15 terms leave less than the rounding error.
    identity = np.eye(matrix.shape[0]).astype(matrix.dtype)
    result = identity
    for k in range(_TERMS, 0, -1):
        result = _product(small, result) / k + identity
    for _ in range(squarings):
        result = _product(result, result)
    return result


@_compiled
def _product(left: Any, right: Any) -> Any:
    """Product of two small matrices, without BLAS."""
    result = np.zeros((left.shape[0], right.shape[1]), dtype=left.dtype)
    for i in range(left.shape[0]):
        for k in range(right.shape[0]):
            for j in range(right.shape[1]):
                result[i, j] += left[i, k] * right[k, j]
    return result


@_compiled
def _piece(chain: Any, entry: Any, length: float) -> Any:
    """Transition over ``length``, and columns of the effects of input value and slope."""
    n = entry.size
    augmented = np.zeros((n + 2, n + 2), dtype=chain.dtype)
    augmented[:n, :n] = chain * length
    augmented[:n, n] = entry * length
    augmented[n, n + 1] = length
    return _exponential(augmented)


@_compiled
def _differentiated(chain: Any, entry: Any, count: int) -> Any:
    """Rows that turn the state into the output's derivatives, and what of the input they add."""
    n = entry.size
    rows, direct = np.zeros((count, n), dtype=chain.dtype), np.zeros(count, dtype=chain.dtype)
    if n:
        rows[0, n - 1] = 1.0
    else:
        direct[0] = 1.0
    for k in range(1, count):
        direct[k] = np.sum(rows[k - 1] * entry)
        rows[k : k + 1] = _product(rows[k - 1 : k], chain)
    return rows, direct


@_compiled
def _derivatives(
    constants: Any,
    integrators: int,
    count: int,
    pieces: tuple[float, float],
    kicked: bool,
    start: FloatArray,
    now: FloatArray,
    rising: FloatArray,
    now_rising: FloatArray,
    given: FloatArray,
) -> FloatArray:
    """Derivatives of the last state, from rest or after an impulse.

    The input's knots divide each step in two pieces. It is given at the start of each step and at
    its knot (now), as its slope before and after that (both empty of a held input), and at the
    samples.
    """
    chain, entry = _chain(constants, integrators)
    n, samples = entry.size, now.size
    before, after = _piece(chain, entry, pieces[0]), _piece(chain, entry, pieces[1])
    rows, direct = _differentiated(chain, entry, count)
    step, early = (
        _product(after[:n, :n], before[:n, :n]),
        _product(after[:n, :n], before[:n, n:]),
    )
    result = np.zeros((samples, count))
    largest = 0.0
    state, following = np.zeros(n, dtype=chain.dtype), np.zeros(n, dtype=chain.dtype)
    if kicked:
        state[:] = entry
    for k in range(samples):
        for c in range(count):
            value = direct[c] * given[k]
            for i in range(n):
                value += rows[c, i] * state[i]
            result[k, c] = value.real
        if kicked:
            size = np.max(np.abs(state))
            largest = max(largest, size)
            if size < _GONE * largest:
                break
        for i in range(n):
            value = early[i, 0] * start[k] + after[i, n] * now[k]
            if rising.size:
                value += early[i, 1] * rising[k] + after[i, n + 1] * now_rising[k]
            for j in range(i + 1):
                value += step[i, j] * state[j]
            following[i] = value
        state[:] = following
    return result
