"""Second routes to claims of Sarosi."""

import math

import numpy as np
from scipy.optimize import differential_evolution, minimize, minimize_scalar
from scipy.special import lambertw

from tests.unit.papers.second_route.printed_files import column, rows

_EPS = np.finfo(float).eps
_MAP = [row for row in rows("dmsp20_300_force_map.csv") if float(row["force_N"]) != 0.0]
_BAR = np.array(column(_MAP, "p_gauge_Pa")) / 1e5
_CONTRACTION = np.array(column(_MAP, "contraction_ratio"))
_FORCE = np.array(column(_MAP, "force_N"))


def angles_by_largest_volume():
    """Fibre angle at which a muscle is fullest at 25 and at 27 % contraction [deg].

    A bisection by the angle, with the largest volume of a wound fibre searched for each.
    """

    def fullest(angle):
        def volume(contraction):
            along = (1.0 - contraction) * math.cos(angle)
            return (1.0 - along**2) * along

        found = minimize_scalar(
            lambda k: -volume(k), bounds=(0.0, 0.6), method="bounded", options={"xatol": 1e-12}
        )
        return found.x

    result = []
    for printed in (0.25, 0.27):
        low, high = 0.2, 0.95
        for _ in range(40):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if fullest(middle) > printed else (low, middle)
        result.append(math.degrees(0.5 * (low + high)))
    # A maximum is found to the root of rounding, of a contraction of 1 - 1/(sqrt(3) cos(angle)).
    return result, np.degrees(2.0 * math.sqrt(_EPS))


def largest_contraction_by_lambert():
    """Where (4) of the DMSP-20-200 at 6 bar is zero [%]: A exp(c k) + D k + E = 0.

    Constants of the later work, in bar and percent; with Lambert's W the zero has a closed form.
    """
    factor = -4.00180705 * 6.0 + 292.4620246
    decay, slope = -0.32930845, -9.33564098 * 6.0
    end = 294.0538256 * 6.0 - 280.498151
    start = -end / slope
    result = start - lambertw(factor * decay / slope * math.exp(decay * start)).real / decay
    # The package's root is good to 1e-12 of a contraction.
    return result, 2e-10


def errors_of_both_fits():
    """RMS errors of (2) and (4) on the map of a DMSP-20, by searches over what is not linear [N].

    (4) is linear but for the c of its exponential; (2) but for a_eps and b_eps.
    """

    def rest(columns):
        basis = np.stack(columns, axis=1)
        miss = basis @ np.linalg.lstsq(basis, _FORCE, rcond=None)[0] - _FORCE
        return math.sqrt(float(np.mean(miss**2)))

    def exponential(decay):
        fall, one = np.exp(decay * _CONTRACTION), np.ones_like(_BAR)
        return rest([_BAR * fall, fall, _BAR * _CONTRACTION, _CONTRACTION, _BAR, one])

    tangent, sine = math.tan(math.radians(28.6)), math.sin(math.radians(28.6))

    def corrected(eps):
        strain = (eps[0] * np.exp(-_BAR) - eps[1]) * _CONTRACTION
        pull = 1e5 * _BAR * math.pi * 0.01**2
        pull = pull * (3.0 / tangent**2 * (1.0 - strain) ** 2 - 1.0 / sine**2)
        return rest([np.exp(-40.0 * _CONTRACTION) * pull, -pull])

    grid = np.linspace(-100.0, -1.0, 100)
    near = float(grid[int(np.argmin([exponential(c) for c in grid]))])
    new = minimize_scalar(exponential, bounds=(near - 1.0, near + 1.0), method="bounded").fun
    box = [(-5.0, 5.0), (-5.0, 5.0)]
    coarse = differential_evolution(corrected, box, rng=1, tol=1e-6, polish=False).x
    old = minimize(corrected, coarse, method="Nelder-Mead").fun
    # The package's search ends when the sum of squares falls by less than 1e-8 of itself.
    return (old, new), 1e-8 * np.array([old, new])


ROUTES = {
    "sarosi-03": angles_by_largest_volume,
    "sarosi-11": largest_contraction_by_lambert,
    "sarosi-17": errors_of_both_fits,
}
