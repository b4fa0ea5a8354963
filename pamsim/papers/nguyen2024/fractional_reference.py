"""References for the fractional Maxwell element: its stiffness, its derivative, its printed loop.

`simulate_fractional` solves Nguyen 2024, (8), with the derivative (7) itself and its whole history;
slow, and of a known order. `loop_distance` is the printed loop (13), with which Nguyen 2024
identifies the element.

The element's order is alpha [-], its time constant beta [s] and its stiffness K_e [N/m]; omega is
the angular frequency w [rad/s], positive, and amplitude F_0 [N].
"""

from __future__ import annotations

import cmath
import math

import numpy as np

from pamsim.core.units import FloatArray


def complex_stiffness(
    omega: float, order: float, time_constant: float, stiffness: float
) -> complex:
    """K*(w) = K_e (jw beta)^alpha / (1 + (jw beta)^alpha) [N/m] (Nguyen 2024, (9))."""
    z = (omega * time_constant) ** order * cmath.exp(0.5j * math.pi * order)
    return stiffness * z / (1.0 + z)


def fractional_derivative_weights(order: float, count: int) -> FloatArray:
    """Weights of the L1 scheme for D^alpha [-]: b_j = (j + 1)^(1 - alpha) - j^(1 - alpha).

    D^alpha y(t_n) is the sum of b_j (y_(n-j) - y_(n-j-1)) over h^alpha Gamma(2 - alpha), with an
    error of order h^(2 - alpha) for smooth y (Oldham and Spanier 1974; Lin and Xu 2007).
    """
    j = np.arange(count + 1, dtype=np.float64)
    return np.diff(j ** (1.0 - order))


def simulate_fractional(
    x: FloatArray, step: float, order: float, time_constant: float, stiffness: float
) -> FloatArray:
    """Force (n,) [N] of the element by Nguyen 2024, (8), with its whole history.

    With q = x - F/K_e the equation reads beta^alpha D^alpha q = F/K_e, which the L1 scheme solves
    step by step [s] for the newest q. The displacement x (n,) [m] is from rest, x_0 = 0.
    """
    weights = fractional_derivative_weights(order, len(x))
    scale = (time_constant / step) ** order / math.gamma(2.0 - order)
    q = np.zeros(len(x))
    increments = np.zeros(len(x))
    for n in range(1, len(x)):
        history = float(np.dot(weights[1:n], increments[n - 1 : 0 : -1]))
        q[n] = (x[n] + scale * (q[n - 1] - history)) / (1.0 + scale)
        increments[n] = q[n] - q[n - 1]
    return stiffness * (x - q)


def loop_distance(
    x: FloatArray,
    force: FloatArray,
    amplitude: float,
    omega: float,
    order: float,
    time_constant: float,
    stiffness: float,
) -> FloatArray:
    """How far points (n,) [m], [N] lie from the loop (13) of Nguyen 2024 under F = F_0 sin(w t).

    The two squares in (13) are cos^2 and sin^2 of w t, so their root less 1 is the radial distance
    in units of F_0 [-], 0 on the loop.
    """
    u = (omega * time_constant) ** order
    turn = 0.5 * math.pi * order
    along = (stiffness * u * x - (u + math.cos(turn)) * force) / (amplitude * math.sin(turn))
    return np.hypot(along, force / amplitude) - 1.0
