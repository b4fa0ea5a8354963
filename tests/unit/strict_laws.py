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


def remainder(a: float, b: float) -> float:
    return a % b


def early(a: float, b: float) -> float:
    k = 0
    while k < 10:
        if a + k > b:
            return float(k)
        k += 1
    return math.nan


def both(a: float, b: float) -> tuple[float, int]:
    return max(a, b, 0.5), math.floor(a)


def parts(a: float, b: float) -> float:
    larger, floor = both(a, b)
    return larger + floor + both(b, a)[1]


def scaled(x: float, by: float = 3.0) -> float:
    return x * by


def passing(a: float, b: float) -> float:
    low = high = a
    passed = False
    for _ in range(20):
        if low > b:
            passed = True
            break
        low += 0.5
    return scaled(low, by=2.0) + high if passed else scaled(a)
