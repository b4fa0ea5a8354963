"""Legendre's incomplete elliptic integrals by Carlson's symmetric ones, in scalars.

The shape of a pleated muscle needs them in code that can be compiled, which scipy's are not. The
duplication theorem (Carlson 1995; DLMF 19.26.18) brings the three arguments together four times
closer per step; then a series in what is left of their spread ends it (DLMF 19.36.1, 19.36.2).
"""

from __future__ import annotations

import math


def carlson_rf(x: float, y: float, z: float) -> float:
    """Carlson's elliptic integral R_F (DLMF 19.16.1) by duplication (DLMF 19.36.1).

    Args:
        x: not negative, and at most one of the three zero.
        y: likewise.
        z: likewise.

    Returns:
        R_F(x, y, z) [-]. Each step makes the spread of the three four times smaller, so that some
        ten steps do; only NaN goes on to the bound of the loop.
    """
    for _ in range(40):
        mean = (x + y + z) / 3.0
        if abs(x - mean) + abs(y - mean) + abs(z - mean) < 8e-3 * mean:
            break
        mixed = math.sqrt(x) * math.sqrt(y) + math.sqrt(z) * (math.sqrt(x) + math.sqrt(y))
        x, y, z = 0.25 * (x + mixed), 0.25 * (y + mixed), 0.25 * (z + mixed)
    mean = (x + y + z) / 3.0
    dx, dy = 1.0 - x / mean, 1.0 - y / mean
    dz = -dx - dy
    e2, e3 = dx * dy - dz * dz, dx * dy * dz
    series = 1.0 - e2 / 10.0 + e3 / 14.0 + e2 * e2 / 24.0 - 3.0 * e2 * e3 / 44.0
    return series / math.sqrt(mean)


def carlson_rd(x: float, y: float, z: float) -> float:
    """Carlson's elliptic integral R_D (DLMF 19.16.5) by duplication (DLMF 19.36.2).

    Args:
        x: not negative, and not zero together with y.
        y: likewise.
        z: positive.

    Returns:
        R_D(x, y, z) [-], in as many steps as `carlson_rf`.
    """
    total, weight = 0.0, 1.0
    for _ in range(40):
        mean = (x + y + 3.0 * z) / 5.0
        if abs(x - mean) + abs(y - mean) + abs(z - mean) < 8e-3 * mean:
            break
        mixed = math.sqrt(x) * math.sqrt(y) + math.sqrt(z) * (math.sqrt(x) + math.sqrt(y))
        total += 3.0 * weight / (math.sqrt(z) * (z + mixed))
        weight *= 0.25
        x, y, z = 0.25 * (x + mixed), 0.25 * (y + mixed), 0.25 * (z + mixed)
    mean = (x + y + 3.0 * z) / 5.0
    dx, dy = 1.0 - x / mean, 1.0 - y / mean
    dz = -(dx + dy) / 3.0
    e2 = dx * dy - 6.0 * dz * dz
    e3 = (3.0 * dx * dy - 8.0 * dz * dz) * dz
    e4 = 3.0 * (dx * dy - dz * dz) * dz * dz
    e5 = dx * dy * dz * dz * dz
    series = 1.0 - 3.0 * e2 / 14.0 + e3 / 6.0 + 9.0 * e2 * e2 / 88.0
    series += -3.0 * e4 / 22.0 - 9.0 * e2 * e3 / 52.0 + 3.0 * e5 / 26.0
    return total + weight * series / (mean * math.sqrt(mean))


def first_elliptic_integral(amplitude: float, parameter: float) -> float:
    """Legendre's F(a|m), the integral of 1 / sqrt(1 - m sin^2 t) (DLMF 19.25.5).

    Args:
        amplitude: a in [0, pi/2] [rad].
        parameter: m in [0, 1).

    Returns:
        F(a|m) [-].
    """
    sine, cosine = math.sin(amplitude), math.cos(amplitude)
    return sine * carlson_rf(cosine * cosine, 1.0 - parameter * sine * sine, 1.0)


def elliptic_integrals(amplitude: float, parameter: float) -> tuple[float, float]:
    """F(a|m) and B = (F - E) / m, the integral of sin^2 t / sqrt(1 - m sin^2 t) (DLMF 19.25.9).

    Args:
        amplitude: a in [0, pi/2] [rad].
        parameter: m in [0, 1).

    Returns:
        F(a|m) and B(a|m) [-]; E(a|m) is F - m B.
    """
    sine, cosine = math.sin(amplitude), math.cos(amplitude)
    x, y = cosine * cosine, 1.0 - parameter * sine * sine
    return sine * carlson_rf(x, y, 1.0), sine * sine * sine * carlson_rd(x, y, 1.0) / 3.0
