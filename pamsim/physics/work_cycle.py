"""Work that a muscle gives over the work that its air does, in one cycle of length and pressure.

A muscle that shortens at a pressure, is vented, lengthens without pressure and is filled again
gives the difference of its force's work on the two ways. Its air does the integral of p dV. Without
hysteresis, which is left out here, both must be equal.
"""

from __future__ import annotations

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.physics.record import Parameters
from pamsim.physics.static_muscle import static_force, static_volume

_POINTS = 401  # on each side of the cycle; the trapezium rule is right to 1e-6 there


def work_ratio(m: Parameters, pressure: float, contraction: float) -> float:
    """Mechanical over pneumatic work of the cycle [-]; 1 if no energy is made or lost.

    Args:
        m: parameters of a muscle.
        pressure: gauge, at which it shortens [Pa].
        contraction: it goes from minus to plus this [-].
    """
    stroke = np.linspace(-contraction, contraction, _POINTS)
    filling = np.linspace(0.0, pressure, _POINTS)
    still = np.ones(_POINTS)
    kappa = np.concatenate([stroke, contraction * still, stroke[::-1], -contraction * still])
    held = np.concatenate([pressure * still, filling[::-1], 0.0 * still, filling])
    length: FloatArray = (1.0 - kappa) * m.braid.nominal_length
    tendon: FloatArray = length - m.mounting.length_at_zero
    places = list(zip(tendon.tolist(), held.tolist(), strict=True))
    given = -np.trapezoid([static_force(m, *place) for place in places], length)
    return float(given / np.trapezoid(held, [static_volume(m, *place) for place in places]))
