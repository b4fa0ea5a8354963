"""Second routes to claims of Matiskova 2021."""

import math

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq

_T1, _T2 = 0.090314, 0.57873  # (31) [s]
_RATE = 500.0  # section 2.4 [Hz]
_LENGTH = 6.0  # of the record that claims 31 to 33 report [s]


def area_above_the_step():
    """T1 + T2 as the area between the step response of (31) and its end, by integration of its
    differential equations."""

    def rate(_, state):
        inner, outer, _ = state
        return [(1.0 - inner) / _T1, (inner - outer) / _T2, 1.0 - outer]

    end = solve_ivp(rate, (0.0, 30.0 * _T2), [0.0] * 3, method="DOP853", rtol=1e-12, atol=1e-13)
    # Steps of relative 1e-12 each; after 30 T2 exp(-30) is left. Printed to 1e-6.
    return end.y[2, -1], len(end.t) * 1e-12 + math.exp(-30.0)


def first_order_lag_by_its_derivative():
    """T of G1 from a step of (31), output error: zero of the derivative of the sum of squares.

    The response is stepped by the matrix exponential of both lags in a row, input included, and
    divided by the mean of its last 2 %.
    """
    count = round(_LENGTH * _RATE) + 1
    time = np.arange(count) / _RATE
    lags = np.array([[-1 / _T1, 0, 1 / _T1], [1 / _T2, -1 / _T2, 0], [0, 0, 0]])
    over_a_sample, state, response = expm(lags / _RATE), np.array([0.0, 0.0, 1.0]), []
    for _ in range(count):
        response.append(state[1])
        state = over_a_sample @ state
    response = np.array(response) / np.mean(response[-(count // 50) :])

    def slope(constant):
        fall = np.exp(-time / constant)
        return float(np.sum((1.0 - fall - response) * time * fall))

    # The package's search stops at a relative 1e-12 of cost or place: at worst the root of it.
    return brentq(slope, 0.3, 1.5, xtol=1e-14), 1e-6


ROUTES = {
    "matiskova2021-30": area_above_the_step,
    "matiskova2021-31": first_order_lag_by_its_derivative,
}
