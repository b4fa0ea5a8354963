"""Functions like those of laws, which numba and Warp compile."""

from __future__ import annotations

import math

WEIGHTS = ((0.5, 2), (0.25, 3))


def fibonacci(a: float, b: float) -> float:
    for _ in range(5):
        a, b = b, a + b
    return a - b


def between(a: float, b: float) -> float:
    return 1.0 if -1.0 < a <= b < math.inf else -1.0


def weighted(a: float, b: float) -> float:
    total, count = a, 0
    for weight, power in WEIGHTS:
        for sign in (1.0, -1.0):
            total += sign * weight * b**power * (1 + count)
            count += 1
    return total
