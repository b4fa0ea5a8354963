"""Second routes to claims of Nguyen 2024."""

import math

import numpy as np

_LENGTH, _DIAMETER = 0.3, 0.02  # section 4.1 [m]
_ANGLE = math.radians(28.6)
_ATMOSPHERE = 101325.0
_FIBRE = _LENGTH / math.cos(_ANGLE)


def _helix(contraction):
    """Angle of the fibres [rad] and diameter [m] at a contraction; fibres and turns stay."""
    angle = math.acos((1.0 - contraction) * _LENGTH / _FIBRE)
    return angle, _DIAMETER * math.sin(angle) / math.sin(_ANGLE)


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


ROUTES = {
    "nguyen2024-07": time_for_heat_by_a_grid,
}
