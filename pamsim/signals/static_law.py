"""Static characteristics that the papers fitted to measured end positions: no memory, no rate.

Exponential: y = a0 + a1 exp(-x) + a2 x exp(-x), the antagonistic arm's angle over the pressure
difference (Matiskova 2021, equation (17)). Arctangent: y = a0 arctan(a1 x + a2) + a3, one branch of
a muscle's length over pressure (Alraouf 2025, equations (1) and (2); its "b0 +" read as "b0").
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


def exponential_basis(x: ArrayLike) -> FloatArray:
    """Factor of each coefficient of the exponential law (Matiskova 2021, equation (22)).

    Args:
        x: (n,) pressure difference over the pressure that counts as 1 [-].

    Returns:
        (n, 3): 1, exp(-x), x exp(-x).
    """
    values = np.asarray(x, dtype=np.float64)
    decay = np.exp(-values)
    return np.stack([np.ones_like(values), decay, values * decay], axis=-1)


def exponential_law(x: ArrayLike, a0: float, a1: float, a2: float) -> FloatArray:
    """The exponential law for x >= 0 (Matiskova 2021, equation (17)).

    Args:
        x: (n,) pressure difference over the pressure that counts as 1 [-].
        a0: value far out [unit of y].
        a1: [unit of y].
        a2: [unit of y].

    Returns:
        (n,) y.
    """
    return exponential_basis(x) @ np.array([a0, a1, a2])


def odd_exponential_basis(x: ArrayLike) -> FloatArray:
    """`exponential_basis` continued as odd functions: sign(x) times the basis at abs(x).

    Args:
        x: (n,) of either sign [-].

    Returns:
        (n, 3).
    """
    values = np.asarray(x, dtype=np.float64)
    return np.sign(values)[..., np.newaxis] * exponential_basis(np.abs(values))


def exponential_slope(x: ArrayLike, a1: float, a2: float) -> FloatArray:
    """Slope dy/dx of the exponential law for x >= 0.

    Args:
        x: (n,) [-].
        a1: see `exponential_law`.
        a2: see `exponential_law`.

    Returns:
        (n,) dy/dx.
    """
    values = np.asarray(x, dtype=np.float64)
    return (a2 - a1 - a2 * values) * np.exp(-values)


def arctangent_law(x: ArrayLike, a0: float, a1: float, a2: float, a3: float) -> FloatArray:
    """One branch of the arctangent loop (Alraouf 2025, equations (1) and (2)).

    Args:
        x: (n,) pressure [unit of 1/a1].
        a0: half-height over pi/2 [unit of y].
        a1: steepness [1 / unit of x].
        a2: shift [-].
        a3: value in the middle [unit of y].

    Returns:
        (n,) y.
    """
    return a0 * np.arctan(a1 * np.asarray(x, dtype=np.float64) + a2) + a3


def arctangent_jacobian(x: ArrayLike, a0: float, a1: float, a2: float) -> FloatArray:
    """Derivatives of `arctangent_law` by its four coefficients.

    Args:
        x: (n,) pressure [unit of 1/a1].
        a0: see `arctangent_law`.
        a1: see `arctangent_law`.
        a2: see `arctangent_law`.

    Returns:
        (n, 4): by a0, a1, a2, a3.
    """
    values = np.asarray(x, dtype=np.float64)
    inner = a1 * values + a2
    steep = a0 / (1.0 + inner * inner)
    return np.stack([np.arctan(inner), steep * values, steep, np.ones_like(values)], axis=-1)
