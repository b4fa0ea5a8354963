"""Closed-form unit-step responses of G1 and G2, safe where the two time constants meet."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray


def _positive(value: float, name: str) -> float:
    if not (np.isfinite(value) and value > 0.0):
        raise InputError(f"{name} = {value!r} s is not a positive time; give a finite value > 0")
    return float(value)


def first_order_step(time: ArrayLike, time_constant: float, gain: float = 1.0) -> FloatArray:
    """Response of ``G1 = K / (T s + 1)`` to a unit step at t = 0 [s], from rest; before that 0.

    Source: Matiskova 2021 (Appl. Sci. 2021, 11, 7288), equation (24).
    """
    scale = _positive(time_constant, "time constant T")
    t = np.maximum(np.asarray(time, dtype=np.float64), 0.0)
    return np.asarray(-gain * np.expm1(-t / scale), dtype=np.float64)


def second_order_step(
    time: ArrayLike, first: float, second: float, gain: float = 1.0
) -> FloatArray:
    """Response of ``G2 = K / ((T1 s + 1)(T2 s + 1))`` to a unit step at t = 0, from rest.

    The textbook form divides by ``T1 - T2``. Here, with Ts <= Tl the smaller and larger constant,
    ``x = t (Tl - Ts) / (Ts Tl)`` and ``phi(x) = (1 - exp(-x)) / x``, the same response is
    ``K (1 - exp(-t/Tl) (1 + (t/Tl) phi(x)))``: phi is smooth with phi(0) = 1, so nothing cancels
    and T1 = T2 needs no case of its own. Before 0 the response is 0.

    Source: Matiskova 2021 (Appl. Sci. 2021, 11, 7288), equation (24); form with phi derived here.
    """
    small, large = sorted((_positive(first, "T1"), _positive(second, "T2")))
    t = np.maximum(np.asarray(time, dtype=np.float64), 0.0)
    scaled = t / large
    x = scaled * ((large - small) / small)
    safe = np.where(x > 0.0, x, 1.0)
    phi = np.where(x > 0.0, -np.expm1(-safe) / safe, 1.0)
    return np.asarray(gain * (-np.expm1(-scaled) - np.exp(-scaled) * scaled * phi))


def unit_step(time: ArrayLike, constants: tuple[float, ...]) -> FloatArray:
    """Return the unit-gain step response of one lag (T,) or two (T1, T2), shape of ``time`` [-]."""
    return (first_order_step if len(constants) == 1 else second_order_step)(time, *constants)
