"""Time constants of stable poles as the coordinates that a search moves in, and back."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamsim.core.units import FloatArray

_REAL = 1e-9  # imaginary over absolute value, below which a time constant is real


def pole_coordinates(constants: NDArray[Any] | Sequence[complex]) -> FloatArray:
    """Return ``ln wn, ln zeta`` of each pair, then ``ln T`` of the lag that is left over.

    These are the pole coordinates of a `ContinuousStructure` with any poles. The constants are
    ``-1 / s`` of every pole s, real or in conjugate pairs, real parts > 0 [s].
    """
    values = np.asarray(constants, dtype=complex)
    real = np.abs(np.imag(values)) <= _REAL * np.abs(values)
    oscillating = values[~real & (np.imag(values) > 0.0)]
    lags = np.sort(np.real(values[real]))
    coordinates: list[float] = []
    for constant in oscillating:
        size = abs(constant)
        coordinates += [-np.log(size), np.log(constant.real / size)]
    for fast, slow in lags[: lags.size // 2 * 2].reshape(-1, 2):
        middle = np.sqrt(fast * slow)
        coordinates += [-np.log(middle), np.log(0.5 * (fast + slow) / middle)]
    coordinates += [float(np.log(constant)) for constant in lags[lags.size // 2 * 2 :]]
    return np.array(coordinates)


def constants_of_roots(roots: NDArray[Any], shortest: float, longest: float) -> NDArray[Any]:
    """Return the time constants of poles [rad/s], unstable ones mirrored, within a range [s]."""
    size = np.clip(np.abs(roots), 1.0 / longest, 1.0 / shortest)
    angle = np.angle(np.where(roots == 0.0, -1.0, roots))
    # Mirrored at the imaginary axis, and away from it, where the damping would be 0.
    away = np.clip(np.abs(angle), 0.5 * np.pi + 1e-2, np.pi)
    return np.exp(-1j * np.sign(angle) * (np.pi - away)) / size
