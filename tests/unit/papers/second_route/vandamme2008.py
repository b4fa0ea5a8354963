"""Second routes to claims of Van Damme 2008."""

import math

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root

_SLENDERNESS = 6.0
_TOLERANCE = 1e-11
"""Of the integrations and of the shooting, relative."""


def _meridian(tension, widest):
    """Half a meridian from the equator to the end disc, for l0 = 1 and p = 1.

    A strip of fibres under tension T bends by 2 pi r p / T: the pressure on it has nothing else to
    hold it. Integrated are radius, height, angle to the axis and volume over the arc length.
    """

    def rate(_, state):
        radius, _, angle, _ = state
        return [
            -math.sin(angle),
            math.cos(angle),
            2.0 * math.pi * radius / tension,
            math.pi * radius**2 * math.cos(angle),
        ]

    start = [widest, 0.0, 0.0, 0.0]
    path = solve_ivp(rate, (0.0, 0.5), start, method="DOP853", rtol=_TOLERANCE, atol=1e-13)
    return path.y[:, -1]


def _bulged(contraction, guess):
    """Tension and radius at the equator of a muscle with a given contraction."""

    def miss(unknown):
        radius, height, _, _ = _meridian(*np.exp(unknown))
        return [radius * _SLENDERNESS - 1.0, 2.0 * height - 1.0 + contraction]

    return np.exp(root(miss, np.log(guess), tol=_TOLERANCE).x)


def force_as_lost_volume():
    """f_t0 at 5 and 35 %: -dV/dl of the volume under integrated meridians, p and l0 being 1."""
    contractions, result, guess, h = np.array([0.05, 0.35]), [], (1.5, 0.25), 2e-3
    for contraction in contractions.tolist():
        guess = _bulged(contraction, guess)
        volume = [2.0 * _meridian(*_bulged(contraction + k * h, guess))[3] for k in (-2, -1, 1, 2)]
        result.append((8.0 * (volume[2] - volume[1]) - (volume[3] - volume[0])) / (12.0 * h))
    # The stencil leaves h^4/30 of the force's fourth derivative, here of its steepest part, pi/6
    # (6 eps)^-1/2, twice for the rest; volumes of 0.1 are good to a hundred integration steps.
    fourth = 105.0 / 16.0 * math.pi / 6.0 / math.sqrt(6.0) * contractions**-4.5
    return result, 2.0 * h**4 / 30.0 * fourth + 0.1 * 100 * _TOLERANCE / h


def contractions_under_a_load():
    """Contraction [%] at 50 N and 1, 1.5 and 2.5 bar: meridians with a given force.

    The force is what the fibres pull at the equator less the pressure on its disc; the end radius
    alone is shot at, and the contraction is read off.
    """
    result = []
    for pressure in (1e5, 1.5e5, 2.5e5):
        force = 50.0 / (pressure * 0.06**2)

        def miss(widest, force=force):
            return _meridian(force + math.pi * widest[0] ** 2, widest[0])[0] * _SLENDERNESS - 1.0

        widest = root(miss, 0.3, tol=_TOLERANCE).x[0]
        height = _meridian(force + math.pi * widest**2, widest)[1]
        result.append(100.0 * (1.0 - 2.0 * height))
    # In percent, a hundred steps of integration.
    return result, 100.0 * 100 * _TOLERANCE


ROUTES = {
    "vandamme2008-05": force_as_lost_volume,
    "vandamme2008-08": contractions_under_a_load,
}
