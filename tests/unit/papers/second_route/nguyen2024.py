"""Second routes to claims of Nguyen 2024."""

import math

import numpy as np
from scipy.integrate import quad

from tests.unit.papers.second_route.printed_files import printed

_PRINTED = printed("nguyen2024")
_LENGTH, _DIAMETER = 0.3, 0.02  # section 4.1 [m]
_ANGLE = math.radians(28.6)
_ORDER, _BETA, _STIFFNESS = 0.27, 49.82, 2260.0  # section 4.2; beta in s and Ke in N/m assumed
_ATMOSPHERE = 101325.0
_FIBRE = _LENGTH / math.cos(_ANGLE)


def _helix(contraction):
    """Angle of the fibres [rad] and diameter [m] at a contraction; fibres and turns stay."""
    angle = math.acos((1.0 - contraction) * _LENGTH / _FIBRE)
    return angle, _DIAMETER * math.sin(angle) / math.sin(_ANGLE)


def pull_from_equilibrium_of_fibres():
    """Least pull of (3) up to 30 % at 3.7 bar, by forces instead of virtual work.

    A fibre of tension t crosses each meridian cut once a turn and each cross cut once. Across the
    meridian all fibres hold p D l: 2 t sin(theta) times the crossings. Along the axis they pull
    t cos(theta) each, less the pressure on the closed end.
    """
    pressure, pulls = 3.7e5, []
    for contraction in np.linspace(0.0, 0.3, 31).tolist():
        angle, diameter = _helix(contraction)
        along = (1.0 - contraction) * _LENGTH
        turns = _FIBRE * math.sin(_ANGLE) / (math.pi * _DIAMETER)
        tension = pressure * diameter * along / (2.0 * turns * math.sin(angle))
        pulls.append(tension * math.cos(angle) - 0.25 * math.pi * diameter**2 * pressure)
    # Forces of 200 N round at 1e-13 N. The package's deviation, here 0, is that of a difference
    # over 2e-6 m of volumes of 1e-4 m^3, which round at 2e-20 m^3, ten times in all.
    return (0.0, min(pulls)), np.array([3.7e5 * 10 * 2e-20 / 2e-6, 1e-11])


def time_for_heat_by_a_grid():
    """Time to compress the stroke, and the slowest decay of heat in the air of the bore.

    The eigenvalue of the radial heat equation on a grid of rings, in place of a Bessel zero;
    finite volumes have an error of order h^2, which two grids take out.
    """
    _, diameter = _helix(0.2)
    diffusivity = 2.2e-5 * _ATMOSPHERE / (3.7e5 + _ATMOSPHERE)  # of air at 300 K over pressure

    def decay(rings):
        edges = np.linspace(0.0, 1.0, rings + 1)
        flow = edges[1:-1] * rings
        wall = 2.0 * rings  # half a ring away
        volume = 0.5 * (edges[1:] ** 2 - edges[:-1] ** 2)
        lost = np.append(0.0, flow) + np.append(flow, wall)
        scale = np.sqrt(volume)
        beside = np.diag(flow / scale[1:] / scale[:-1], 1)
        return float(np.linalg.eigvalsh(np.diag(lost / volume) - beside - beside.T)[0])

    coarse, fine = decay(40), decay(80)
    squared = fine + (fine - coarse) / 3.0
    result = (0.5 * diameter) ** 2 / squared / diffusivity
    # The package has the zero to five digits, 2.4048; beyond, the extrapolation is good to h^4.
    share = 2.0 * 0.5e-4 / 2.4048 + 80.0**-2 / 40.0**2
    return (60.0 / 0.6, result), np.array([1e-12, share * result])


def loop_areas_from_the_definition():
    """Area of the loops of Figure 3: integral of F dx over a period.

    D^alpha of a sine that has lasted for ever is the convolution (7), integrated by QUADPACK for
    its singular start and its oscillating tail; the area is integrated too.
    """
    omega, amplitude, ratio = 9.0, 2500.0, 200000.0 / 150000.0
    areas, errors = [], []
    for order in (0.8, 0.5, 0.2):
        parts, off = [], 0.0
        for wave in ("cos", "sin"):
            function = getattr(math, wave)
            near = quad(
                lambda s, f=function: f(omega * s), 0.0, 1.0, weight="alg", wvar=(-order, 0.0)
            )
            far = quad(lambda s, a=order: s**-a, 1.0, math.inf, weight=wave, wvar=omega, limlst=200)
            parts.append(near[0] + far[0])
            off += near[1] + far[1]
        # D^alpha sin(wt) = w/Gamma(1-alpha) times the integral of cos(w(t-s)) s^-alpha over s > 0.
        gain = omega / math.gamma(1.0 - order)
        derivative = gain * complex(parts[1], parts[0])
        # (8): F + r D F = Ke r D x, so F = F0 sin(wt) gives x.
        shift = (1.0 + ratio * derivative) / (150000.0 * ratio * derivative) * amplitude

        def power(t, shift=shift):
            speed = omega * (shift.real * math.cos(omega * t) - shift.imag * math.sin(omega * t))
            return amplitude * math.sin(omega * t) * speed

        area, rounding = quad(power, 0.0, 2.0 * math.pi / omega)
        areas.append(area)
        errors.append(rounding + abs(area) * gain * off / abs(derivative) / abs(derivative.imag))
    return areas, np.array(errors)


def stiffness_by_gruenwald_letnikov():
    """|K*| at the four frequencies of the second study case, (8) in time with GL's differences.

    F and x start at rest; the first harmonic of the last of 40 periods. GL's error is of order h,
    taken out by two steps.
    """

    def stiffness(frequency, samples, periods=40):
        step = 1.0 / (frequency * samples)
        count = periods * samples
        weights = np.cumprod(np.append(1.0, 1.0 - (_ORDER + 1.0) / np.arange(1, count + 1)))
        x = np.sin(2.0 * np.pi * np.arange(count + 1) / samples)
        ratio = (_BETA / step) ** _ORDER
        pulled = _STIFFNESS * ratio * np.convolve(weights, x)[: count + 1]
        force = np.zeros(count + 1)
        for n in range(count + 1):
            past = float(weights[1 : n + 1] @ force[n - 1 :: -1]) if n else 0.0
            force[n] = (pulled[n] - ratio * past) / (1.0 + ratio)
        turn = np.exp(-2j * np.pi * np.arange(samples) / samples)
        last = slice(count - samples, count)
        return abs(np.sum(force[last] * turn) / np.sum(x[last] * turn))

    result = [
        2.0 * stiffness(frequency, 128) - stiffness(frequency, 64)
        for frequency in _PRINTED["second_case_frequencies"]
    ]
    # With z = jwh GL has D^alpha times 1 - alpha z/2 + (alpha/24 + alpha^2/8) z^2: half of the last
    # term at the coarse step is left. A start is forgotten as (w t)^-(1 + alpha), its slope over a
    # period, which is what the harmonic sees, with one power more.
    left = 0.5 * (_ORDER / 24.0 + _ORDER**2 / 8.0) * (2.0 * math.pi / 64.0) ** 2
    start = 2.0 * (2.0 * math.pi * 39.0) ** -(2.0 + _ORDER)
    return result, (left + start) * np.array(result)


ROUTES = {
    "nguyen2024-04": pull_from_equilibrium_of_fibres,
    "nguyen2024-07": time_for_heat_by_a_grid,
    "nguyen2024-16": loop_areas_from_the_definition,
    "nguyen2024-22": stiffness_by_gruenwald_letnikov,
}
