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
    return _derivatives(constants, 0, count, pieces, True, still, still, none, none, still)


def _late(values: FloatArray, samples: int) -> FloatArray:
    """Shift by whole samples; what moves in is the first value, or the last if negative."""
    if samples == 0:
        return values
    return np.take(values, np.arange(values.size) - samples, mode="clip")


@_compiled
def _chain(constants: Any, integrators: int) -> Any:
    """State matrix of the chain, and how its input enters."""
    n = constants.size + integrators
    chain, entry = np.zeros((n, n), constants.dtype), np.zeros(n, constants.dtype)
    for i in range(n):
        if i:
            chain[i, i - 1] = 1.0
        else:
            entry[i] = 1.0
        if i < constants.size:
            rate = 1.0 / constants[i]
            for j in range(i + 1):
                chain[i, j] *= rate
            chain[i, i] = -rate
            entry[i] *= rate
    return chain, entry


@_compiled
def _exponential(matrix: Any) -> Any:
    """Exponential of a few by few matrix, by Taylor series, scaling and squaring."""
    n = matrix.shape[0]
    norm = 0.0
    for i in range(n):
        row = 0.0
        for j in range(n):
            row += abs(matrix[i, j])
        norm = max(norm, row)
    squarings = max(0, int(np.ceil(np.log2(max(2.0 * norm, 1.0)))))
    small, result = np.empty_like(matrix), np.empty_like(matrix)
    for i in range(n):
        for j in range(n):
            small[i, j] = matrix[i, j] / 2.0**squarings
            result[i, j] = 1.0 if i == j else 0.0
    # Horner's scheme; with a norm of at most 1/2, 15 terms leave less than the rounding error.
    for step in range(_TERMS + squarings):
        left = small if step < _TERMS else result
        product = np.empty_like(matrix)
        for i in range(n):
            for j in range(n):
                value = small[0, 0] * 0.0
                for k in range(n):
                    value += left[i, k] * result[k, j]
                if step < _TERMS:
                    value = value / (_TERMS - step)
                    if i == j:
                        value += 1.0
                product[i, j] = value
        result = product
    return result


@_compiled
def _piece(chain: Any, entry: Any, length: float) -> Any:
    """Transition over ``length``, and columns of the effects of input value and slope."""
    n = entry.size
    augmented = np.zeros((n + 2, n + 2), chain.dtype)
    for i in range(n):
        for j in range(n):
            augmented[i, j] = chain[i, j] * length
        augmented[i, n] = entry[i] * length
    augmented[n, n + 1] = length
    return _exponential(augmented)


@_compiled
def _differentiated(chain: Any, entry: Any, count: int) -> Any:
    """Rows that turn the state into the output's derivatives, and what of the input they add."""
    n = entry.size
    rows, direct = np.zeros((count, n), chain.dtype), np.zeros(count, chain.dtype)
    if n:
        rows[0, n - 1] = 1.0
    else:
        direct[0] = 1.0
    for k in range(1, count):
        for i in range(n):
            direct[k] += rows[k - 1, i] * entry[i]
            for j in range(n):
                rows[k, j] += rows[k - 1, i] * chain[i, j]
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
    """Derivatives of the last state, from rest; or after an impulse, the largest value of each 1.

    The input's knots divide each step in two pieces. It is given at the start of each step and at
    its knot (now), as its slope before and after that (both empty of a held input), and at the
    samples.
    """
    chain, entry = _chain(constants, integrators)
    n, samples = entry.size, now.size
    before, after = _piece(chain, entry, pieces[0]), _piece(chain, entry, pieces[1])
    rows, direct = _differentiated(chain, entry, count)
    moved = np.zeros_like(before)
    for i in range(n):
        for k in range(n):
            for j in range(n + 2):
                moved[i, j] += after[i, k] * before[k, j]
    result = np.zeros((samples, count))
    largest, rows_left = 0.0, samples
    peaks = np.zeros(count)
    state, following = np.zeros(n, dtype=chain.dtype), np.zeros(n, dtype=chain.dtype)
    if kicked:
        for i in range(n):
            state[i] = entry[i]
    for k in range(samples):
        for c in range(count):
            value = direct[c] * given[k]
            for i in range(n):
                value += rows[c, i] * state[i]
            result[k, c] = value.real
        if kicked:
            for c in range(count):
                peaks[c] = max(peaks[c], abs(result[k, c]))
            size = 0.0
            for i in range(n):
                size = max(size, abs(state[i]))
            largest = max(largest, size)
            if size < _GONE * largest:
                rows_left = k + 1
                break
        for i in range(n):
            value = moved[i, n] * start[k] + after[i, n] * now[k]
            if rising.size:
                value += moved[i, n + 1] * rising[k] + after[i, n + 1] * now_rising[k]
            for j in range(i + 1):
                value += moved[i, j] * state[j]
            following[i] = value
        for i in range(n):
            state[i] = following[i]
    if kicked:  # of long records most rows stay 0
        for k in range(rows_left):
            for c in range(count):
                if peaks[c] > 0.0:
                    result[k, c] /= peaks[c]
    return result
