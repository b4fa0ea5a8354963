"""Arithmetic that Python has and Warp has not, in the form in which the laws are written."""

from __future__ import annotations

import math


def expm1(x: float) -> float:
    """Exponential minus 1, with all digits for small x (Kahan)."""
    grown = math.exp(x)
    if grown == 1.0:
        return x
    gained = grown - 1.0
    if gained == -1.0 or not math.isfinite(grown):
        return gained
    return gained * x / math.log(grown)


def modulo_float(a: float, b: float) -> float:
    """Remainder with the sign of the divisor, as Python's."""
    rest = math.fmod(a, b)
    if rest != 0.0 and (rest < 0.0) != (b < 0.0):
        return rest + b
    return rest


def modulo_int(a: int, b: int) -> int:
    """Remainder of two whole numbers, neither of them negative."""
    return a - b * math.floor(a / b)
