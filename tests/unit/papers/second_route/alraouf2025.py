"""Second routes to claims of Alraouf 2025; lengths in cm, pressures in kPa."""

import math
from fractions import Fraction

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq, differential_evolution, minimize

from tests.unit.papers.second_route.printed_files import column, rows

_TABLE = rows("alraouf2025_table2.csv")
_PRESSURE = np.array(column(_TABLE, "pressure_kpa"))
_UP = np.array(column(_TABLE, "up_mean_cm"))
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


ROUTES = {
    "alraouf2025-04": coefficients_by_search,
    "alraouf2025-06": half_intervals_by_projection,
    "alraouf2025-41": table_intervals_in_closed_form,
}
