"""Exact sampled response of a chain of lags to a held input, with any fraction of a sample delay.

The chain ``x_i' = (x_(i-1) - x_i) / T_i``, ``x_0 = u``, has the output ``1/D(s) u`` with
``D = (T_1 s + 1)...(T_n s + 1)`` in its last state. Pairs of conjugate T make oscillating models.
Unlike partial fractions it needs no case of its own where time constants meet.
"""

# scipy carries no types: what it returns is Any at this file's boundary.
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false
# pyright: reportUnknownVariableType=false

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.signal
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
_lfilter: Any = scipy.signal.lfilter

_TERMS = 15


def chain_derivatives(
    constants: NDArray[Any],
    given: FloatArray,
    sample_time: float,
    *,
    count: int,
    dead_time: float = 0.0,
    hold: str = "zoh",
) -> FloatArray:
    """Return ``s^k exp(-L s) / D(s) u`` for k = 0..count-1, from rest.

    Args:
        constants: T_1..T_n, real or in conjugate pairs, shape ``(n,)``, real parts > 0 [s].
        given: u at the samples, shape ``(N,)``; before them u = u[0] = 0 is taken [input unit].
        sample_time: Ts [s].
        count: number of derivatives, at most n.
        dead_time: L; slightly negative looks ahead [s].
        hold: ``zoh`` (u constant between samples) or ``foh`` (straight lines).

    Returns:
        Shape ``(N, count)`` [input unit / s^k].

    Source: variation of constants over each sample, in two pieces because a delayed input's knots
    lie inside it; exponential of the chain
        augmented by its input and the input's slope (Van Loan 1978).
    """
    chain, entry = _chain(constants)
    n = constants.size
    whole = int(np.floor(dead_time / sample_time))
    part = dead_time / sample_time - whole
    # One step of the chain with an input (value, slope) that starts a piece of length tau.
    before, before_value, before_slope = _piece(chain, entry, part * sample_time)
    after, after_value, after_slope = _piece(chain, entry, (1.0 - part) * sample_time)
    step = after @ before
    old, now = _late(given, whole + 1)[:-1], _late(given, whole)[:-1]
    if hold == "zoh":
        forcing = np.outer(after @ before_value, old) + np.outer(after_value, now)
    else:
        ahead = _late(given, whole - 1)[:-1]
        rising, next_rising = (now - old) / sample_time, (ahead - now) / sample_time
        start = now - part * (now - old)
        forcing = (
            np.outer(after @ before_value, start)
            + np.outer(after @ before_slope, rising)
            + np.outer(after_value, now)
            + np.outer(after_slope, next_rising)
        )
    states = _recursion(step, forcing, np.zeros(n, dtype=chain.dtype))
    return _rows(chain, count, states)


def chain_modes(constants: NDArray[Any], samples: int, sample_time: float) -> FloatArray:
    """Return n independent free responses of the chain: its impulse response and derivatives.

    Args:
        constants: T_1..T_n as above, shape ``(n,)`` [s].
        samples: N.
        sample_time: Ts [s].

    Returns:
        Shape ``(N, n)``, each column's largest value 1 [-].
    """
    chain, entry = _chain(constants)
    step, _, _ = _piece(chain, entry, sample_time)
    forcing = np.zeros((constants.size, samples - 1), dtype=chain.dtype)
    modes = _rows(chain, constants.size, _recursion(step, forcing, entry))
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


def _chain(constants: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    rates = 1.0 / constants
    chain = np.diag(-rates) + np.diag(rates[1:], -1)
    entry = np.zeros(constants.size, dtype=rates.dtype)
    entry[0] = rates[0]
    return chain, entry


def _piece(
    chain: NDArray[Any], entry: NDArray[Any], length: float
) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Return the transition over ``length`` and the effects of input value and slope."""
    n = entry.size
    augmented = np.zeros((n + 2, n + 2), dtype=chain.dtype)
    augmented[:n, :n] = chain
    augmented[:n, n] = entry
    augmented[n, n + 1] = 1.0
    whole = _exponential(augmented * length)
    return whole[:n, :n], whole[:n, n], whole[:n, n + 1]


def _exponential(matrix: NDArray[Any]) -> NDArray[Any]:
    """Return the exponential of a few by few matrix, by Taylor series, scaling and squaring.

    scipy.linalg.expm solves with a threaded LAPACK: on a busy machine that takes milliseconds for
    a matrix of four rows, and a fit needs thousands.
    """
    identity = np.eye(matrix.shape[0], dtype=matrix.dtype)
    norm = float(np.max(np.sum(np.abs(matrix), axis=1)))
    if norm == 0.0:
        return identity
    squarings = max(0, int(np.ceil(np.log2(max(2.0 * norm, 1.0)))))
    small = matrix / 2.0**squarings
    # Horner's scheme; with a norm of at most 1/2, 15 terms leave less than the rounding error.
    result = identity
    for k in range(_TERMS, 0, -1):
        result = identity + small @ result / k
    for _ in range(squarings):
        result = result @ result
    return result


def _recursion(step: NDArray[Any], forcing: NDArray[Any], initial: NDArray[Any]) -> NDArray[Any]:
    """Return ``x[k+1] = step x[k] + forcing[k]``, shape ``(n, N)``; step is lower triangular."""
    n, steps = forcing.shape
    states = np.empty((n, steps + 1), dtype=step.dtype)
    for j in range(n):
        drive = forcing[j] + step[j, :j] @ states[:j, :-1]
        states[j, 0] = initial[j]
        states[j, 1:], _ = _lfilter(
            [1.0], [1.0, -step[j, j]], drive, zi=np.array([step[j, j] * initial[j]])
        )
    return states


def _rows(chain: NDArray[Any], count: int, states: NDArray[Any]) -> FloatArray:
    """Differentiate the last state ``count - 1`` times: each time its row times the chain."""
    row = np.zeros(chain.shape[0], dtype=chain.dtype)
    row[-1] = 1.0
    columns: list[FloatArray] = []
    for _ in range(count):
        columns.append(np.real(row @ states))
        row = row @ chain
    return np.column_stack(columns)
