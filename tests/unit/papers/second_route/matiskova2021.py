"""Second routes to claims of Matiskova 2021."""

import math
import tomllib
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq

_RIG = Path(__file__).parents[4] / "models" / "mas20_arm" / "params.toml"
_EPS = np.finfo(float).eps
_T1, _T2 = 0.090314, 0.57873  # (31) [s]
_RATE = 500.0  # section 2.4 [Hz]
_LENGTH = 6.0  # of the record that claims 31 to 33 report [s]


def stiffness_from_energy():
    """Parts of the stiffness (5) as second derivatives of energies by the angle.

    At constant pressure the energy of the pair is -sum p V, with its chambers shut that of air
    P V^n = const against the atmosphere. Their difference is the compressibility part. The volume
    is that of a cylinder of length l on which a fibre of length b makes n turns.
    """
    rig = tomllib.loads(_RIG.read_text("utf-8"))
    braid, chamber = rig["muscle"]["braid"], rig["muscle"]["chamber"]
    length, angle = 1e-3 * braid["nominal_length"]["value"], braid["fibre_angle"]["value"]
    index, dead = chamber["polytropic_index"]["value"], 1e-6 * chamber["dead_volume"]["value"]
    arm = 1e-3 * rig["native"]["tendon.chain_1.coef"]["value"]
    fibre = length / math.cos(math.radians(angle))
    around = fibre * math.sin(math.radians(angle)) / (1e-3 * braid["diameter"]["value"])  # pi n
    middle = 0.5 * (length + fibre / math.sqrt(3.0))  # half way to the largest volume
    gauge, air = 487e3, 101325.0

    def inside(at):
        diameter = np.sqrt(fibre**2 - at**2) / around
        return 0.25 * np.pi * diameter**2 * at

    def held(beta):
        return -gauge * sum(inside(middle + way * arm * beta) for way in (-1.0, 1.0))

    def shut(beta):
        start = inside(middle) + dead
        energy = 0.0
        for way in (-1.0, 1.0):
            now = inside(middle + way * arm * beta) + dead
            push = (gauge + air) * start / (index - 1.0) * (now / start) ** (1.0 - index)
            energy += push + air * now
        return energy

    # Polynomials through Chebyshev points of +-1 rad, where the braid is a twelfth of the way to
    # its straight fibres: degree 12 leaves nothing but rounding, which deriving twice raises to
    # the third power of the degree.
    degree = 12
    total, geometric = (
        float(np.polynomial.Chebyshev.interpolate(energy, degree).deriv(2)(0.0))
        for energy in (shut, held)
    )
    return (total - geometric, geometric), degree**3 * _EPS * shut(0.0)


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
    "matiskova2021-23": stiffness_from_energy,
    "matiskova2021-30": area_above_the_step,
    "matiskova2021-31": first_order_lag_by_its_derivative,
}
