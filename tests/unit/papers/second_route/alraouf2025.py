"""Second routes to claims of Alraouf 2025; lengths in cm, pressures in kPa."""

import cmath
import math
from fractions import Fraction

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq, differential_evolution, minimize
from scipy.special import hyp2f1

from tests.unit.papers.second_route.printed_files import column, rows

_TABLE = rows("alraouf2025_table2.csv")
_PRESSURE = np.array(column(_TABLE, "pressure_kpa"))
_UP = np.array(column(_TABLE, "up_mean_cm"))
_LOOP = np.append(_UP, column(_TABLE, "down_mean_cm"))
_PRINTED_UP = (2.7378, -0.0083212, 1.3402, 27.759)  # equation (3)
_PRINTED_MSE = 0.030238  # Table 3


def coefficients_by_search():
    """Least squares, equation (3), as a global search over the two numbers inside the arctangent.

    The two outside follow from a straight line through length over arctangent. Neither a start nor
    a derivative is needed.
    """

    def line(inside):
        bend = np.arctan(inside[0] * _PRESSURE + inside[1])
        away = bend - bend.mean()
        factor = (away @ _UP) / (away @ away)
        return factor, _UP.mean() - factor * bend.mean(), bend

    def cost(inside):
        factor, offset, bend = line(inside)
        return float(np.sum((factor * bend + offset - _UP) ** 2))

    box = [(-0.05, -0.001), (-5.0, 10.0)]
    coarse = differential_evolution(cost, box, rng=1, tol=1e-6, polish=False).x
    fine = {"xatol": 1e-13, "fatol": 0.0, "maxiter": 400}
    inside = minimize(cost, coarse, method="Nelder-Mead", options=fine).x
    factor, offset, _ = line(inside)
    result = (factor, *inside, offset)
    # The cost is known to its rounding, 2e-14 cm^2, and the package's search stops at 1e-14 of it.
    # A standard error raises it by 0.05 cm^2: both lie within 1e-6 standard errors of the minimum.
    return result, 1e-6 * _standard_errors(result, cost(inside) / 7)


def half_intervals_by_projection():
    """Half intervals of Table 1: each column's part that the other three cannot imitate.

    The derivatives are written out, Student's t is integrated, no matrix is inverted.
    """
    quantile = brentq(lambda t: _student_below(t, 7) - 0.975, 1.0, 4.0, xtol=1e-13)
    variance = _PRINTED_MSE * 11 / 7
    result = quantile * _standard_errors(_PRINTED_UP, variance)
    # Inverting J^T J, columns scaled, loses the digits of the condition number squared, once a row.
    derivatives = _derivatives(_PRINTED_UP)
    scaled = derivatives / np.linalg.norm(derivatives, axis=0)
    return result, 11 * np.finfo(float).eps * np.linalg.cond(scaled) ** 2 * result


def _derivatives(coefficients):
    a0, a1, a2, _ = coefficients
    inside = a1 * _PRESSURE + a2
    slope = a0 / (1.0 + inside**2)
    return np.stack([np.arctan(inside), slope * _PRESSURE, slope, np.ones(11)], axis=1)


def _standard_errors(coefficients, variance):
    derivatives = _derivatives(coefficients)
    own = []
    for j in range(4):
        others, _ = np.linalg.qr(np.delete(derivatives, j, axis=1))
        rest = derivatives[:, j] - others @ (others.T @ derivatives[:, j])
        own.append(math.sqrt(variance / float(rest @ rest)))
    return np.array(own)


def _student_below(t, freedom):
    half = 0.5 * (freedom + 1)
    scale = math.gamma(half) / (math.gamma(0.5 * freedom) * math.sqrt(math.pi * freedom))
    above, _ = quad(lambda x: (1.0 + x * x / freedom) ** -half, 0.0, t, epsabs=1e-14)
    return 0.5 + scale * above


def determination_in_fractions():
    """R2 of the printed curve on Table 2, sums in fractions, arctan as Im ln(1 + i x)."""
    a0, a1, a2, a3 = _PRINTED_UP
    lengths = [Fraction(row["up_mean_cm"]) for row in _TABLE]
    bends = [cmath.log(complex(1.0, a1 * p + a2)).imag for p in _PRESSURE.tolist()]
    misses = [Fraction(a0 * b + a3) - y for b, y in zip(bends, lengths, strict=True)]
    mean = sum(lengths) / 11
    spread = sum((y - mean) ** 2 for y in lengths)
    # Rounding: lengths of 30 cm, misses of 0.2 cm, against a variance of 4.3 cm^2.
    return float(1 - sum(miss**2 for miss in misses) / spread), 1e-14


def table_intervals_in_closed_form():
    """Largest deviation of the printed CI from t SD / sqrt(3), rising.

    Student's distribution with 2 degrees of freedom is 1/2 + t / (2 sqrt(2 + t^2)): t is 0.95
    sqrt(2 / (1 - 0.95^2)), and the table is compared in squares of fractions.
    """
    square = Fraction(95, 100) ** 2
    factor = math.sqrt(2 * square / (1 - square) / 3)
    return max(
        abs(float(row["up_ci_cm"]) - factor * float(row["up_sd_cm"])) for row in _TABLE
    ), 1e-11  # to which scipy 1.15 inverts the distribution


def scores_without_memory():
    """MSE, R2, RMSE and MAE, rising, of the static Bouc-Wen loop; best at sigma = 0, n = 20."""
    miss = _bouc_wen(lambda v: (v[0], 0.0, 20.0, v[1]), (4.3, -23.0))[:11]
    square = float(np.mean(miss**2))
    spread = float(np.mean((_UP - _UP.mean()) ** 2))
    result = np.array([square, 1.0 - square / spread, math.sqrt(square), np.mean(np.abs(miss))])
    return result, _GRID * np.array([square, square / spread, *result[2:]])


def errors_of_a_passive_loop():
    """MSE of both branches of the static Bouc-Wen loop with sigma at least 1/2; best there."""
    miss = _bouc_wen(lambda v: (v[0], 0.5, math.exp(v[1]), -20.0), (5.75, 0.9))
    result = np.mean(miss.reshape(2, 11) ** 2, axis=1)
    return result, _GRID * result


_GRID = 1e-4
"""The package's table of z, in cells of 0.005, is off by 0.005^2/8. Times c2, 1.4 cm without memory
and 4.7 cm passive, against residuals of 0.12 and 0.5 cm, that is less than this of a square."""


def _bouc_wen(parameters, start):
    """Residuals of the loop y = c0 + c1 p + c2 z with the least squares.

    That sigma and n end at bounds was found by differential evolution of all four parameters,
    with z followed by Runge-Kutta steps; here they are held. While |z| grows from 0, p/D is
    z 2F1(1, 1/n; 1 + 1/n; z^n), while it falls the same of (1 - 2 sigma) z^n; both are inverted
    by bisection.

    Args:
        parameters: from what is searched to D by its logarithm, sigma, n and ln(1 + z0).
        start: of the search.
    """

    def travel(z, n, share):
        return z * hyp2f1(1.0, 1.0 / n, 1.0 + 1.0 / n, share * z**n)

    def size(travelled, n, share):
        low, high = np.zeros_like(travelled), np.ones_like(travelled)
        for _ in range(52):
            middle = 0.5 * (low + high)
            below = travel(middle, n, share) < travelled
            low, high = np.where(below, middle, low), np.where(below, high, middle)
        return 0.5 * (low + high)

    def followed(z, way, sigma, n):
        """From z towards 1."""
        share = 1.0 - 2.0 * sigma
        t = way + math.copysign(travel(abs(z), n, 1.0 if z > 0.0 else share), z)
        return np.where(
            t > 0.0, size(np.maximum(t, 0.0), n, 1.0), -size(np.maximum(-t, 0.0), n, share)
        )

    def residual(searched):
        log_travel, sigma, n, log_start = parameters(searched)
        way = _PRESSURE / math.exp(log_travel)
        up = followed(math.expm1(log_start), way, sigma, n)
        down = -followed(-up[-1], way, sigma, n)[::-1] if sigma > 0.0 else up
        basis = np.stack([np.ones(22), np.tile(_PRESSURE, 2), np.append(up, down)], axis=1)
        return basis @ np.linalg.lstsq(basis, _LOOP, rcond=None)[0] - _LOOP

    def cost(searched):
        return float(np.sum(residual(searched) ** 2))

    fine = {"xatol": 1e-6, "fatol": 1e-9}
    return residual(minimize(cost, start, method="Nelder-Mead", options=fine).x)


ROUTES = {
    "alraouf2025-04": coefficients_by_search,
    "alraouf2025-06": half_intervals_by_projection,
    "alraouf2025-17": determination_in_fractions,
    "alraouf2025-32": scores_without_memory,
    "alraouf2025-40": errors_of_a_passive_loop,
    "alraouf2025-41": table_intervals_in_closed_form,
}
