"""Second routes to claims of Matiskova 2021."""

import math
import tomllib
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq, differential_evolution, root

from tests.unit.papers.second_route.printed_files import column, rows

_RIG = Path(__file__).parents[4] / "models" / "mas20_arm" / "params.toml"
_EPS = np.finfo(float).eps
_T1, _T2 = 0.090314, 0.57873  # (31) [s]
_RATE = 500.0  # section 2.4 [Hz]
_LENGTH = 6.0  # of the record that claims 31 to 33 report [s]

_STEPS = [row for row in rows("matiskova2021_steps.csv") if not row["repeats"]]
_P1, _P2 = (np.array(column(_STEPS, name)) / 100.0 for name in ("p1_kpa", "p2_kpa"))  # 100 kPa
_LOAD = np.array(column(_STEPS, "load_kg"))
_ANGLE = np.array(column(_STEPS, "beta_deg"))


def exponential_with_free_scale():
    """Coefficients of (17) with the unit of pressure free.

    x exp(-x) is what a change of unit adds to exp(-x). So the fit is that of a0 + a1 exp(-p/s)
    alone, with a2 = 0, wherever the rest is at right angles to p exp(-p/s): one equation for s.
    """
    size, sign = np.abs(_P1 - _P2), np.sign(_P1 - _P2)

    def rest(columns):
        basis = sign[:, None] * np.stack(columns, axis=1)
        result = np.linalg.lstsq(basis, _ANGLE, rcond=None)[0]
        return result, _ANGLE - basis @ result

    def two(scale):
        fall = np.exp(-size / scale)
        return rest([np.ones_like(fall), fall])

    def three(scale):
        x = size / scale
        return rest([np.ones_like(x), np.exp(-x), x * np.exp(-x)])

    def slant(scale):
        x = size / scale
        return float(two(scale)[1] @ (sign * x * np.exp(-x)))

    scale = brentq(slant, 1.0, 3.0, xtol=1e-14)
    (a0, a1), best = two(scale)
    # A search on values finds s where the root mean square no longer changes: its rounding, some
    # eps, over half its curvature. The coefficients follow s by their own derivatives.
    h = 1e-3 * scale
    rms = [float(np.sqrt(np.mean(three(scale + k * h)[1] ** 2))) for k in (-1, 0, 1)]
    curvature = (rms[0] - 2.0 * rms[1] + rms[2]) / h**2
    off = math.sqrt(2.0 * 10.0 * _EPS * rms[1] / curvature)
    derivatives = (three(scale + h)[0] - three(scale - h)[0]) / (2.0 * h)
    assert float(best @ best) <= 21 * rms[1] ** 2 * (1.0 + 1e-12)
    return (a0, a1, 0.0), off * np.abs(derivatives)


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


def angle_law_at_a_stationary_point():
    """c of p1 - p2 = k1 b + k5 b^5 - t m + c (p1 + p2) b, angles fitted, pressures in 100 kPa.

    A global search over all four coefficients, then the point where the gradient vanishes, with
    derivatives of b from the implicit function theorem. b is found by bisection.
    """

    def angles(k):
        k = np.asarray(k)[..., None]
        push, linear = _P1 - _P2 + k[..., 2, :] * _LOAD, k[..., 0, :] + k[..., 3, :] * (_P1 + _P2)
        low, high = np.full(push.shape, -1.5), np.full(push.shape, 1.5)
        for _ in range(54):
            middle = 0.5 * (low + high)
            below = linear * middle + k[..., 1, :] * middle**5 < push
            low, high = np.where(below, middle, low), np.where(below, high, middle)
        return 0.5 * (low + high)

    def derivatives(k, b):
        stiff = k[0] + k[3] * (_P1 + _P2) + 5.0 * k[1] * b**4
        return np.stack([-b, -(b**5), _LOAD, -(_P1 + _P2) * b], axis=1) / stiff[:, None]

    measured = np.radians(_ANGLE)

    def gradient(k):
        b = angles(k)
        return derivatives(k, b).T @ (b - measured)

    coarse = differential_evolution(
        lambda k: np.sum((angles(k.T) - measured) ** 2, axis=-1),
        [(1.0, 6.0), (1.0, 60.0), (-0.5, 0.5), (-0.3, 0.3)],
        rng=1,
        tol=1e-6,
        polish=False,
        vectorized=True,
        updating="deferred",
    ).x
    found = root(gradient, coarse, tol=1e-13).x
    b = angles(found)
    columns = derivatives(found, b)
    others, _ = np.linalg.qr(columns[:, :3])
    own = columns[:, 3] - others @ (others.T @ columns[:, 3])
    miss = b - measured
    error = math.sqrt(float(miss @ miss) / (len(b) - 4) / float(own @ own))
    # The package's search ends when the sum of squares falls by less than 1e-8 of itself.
    return found[3], math.sqrt(1e-8 * (len(b) - 4)) * error


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
    "matiskova2021-10": exponential_with_free_scale,
    "matiskova2021-23": stiffness_from_energy,
    "matiskova2021-25": angle_law_at_a_stationary_point,
    "matiskova2021-30": area_above_the_step,
    "matiskova2021-31": first_order_lag_by_its_derivative,
}
