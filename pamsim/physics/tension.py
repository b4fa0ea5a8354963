"""From the active force to tension: threshold of pressure, loss at the ends, no pushing.

Where the braid meets the fittings it cannot widen: a cone forms that does not pull like the
cylinder, and the more of the length is cone, the further the muscle has contracted (Tondu and Lopez
2000 lengthen the contraction by a factor for it). Here a share of the active force is lost that
sets in at a contraction without a kink and tends to a largest one:

    share = 1 - loss x^2 / (x^2 + 0.1^2),   x = kappa - onset > 0
"""

from __future__ import annotations

from pamsim.core.parameters import ParameterGroup, quantity

_HALF = 0.1  # contraction beyond the onset at which half of the loss is reached


class Threshold(ParameterGroup, group="threshold"):
    """Pressure below which the tube does not yet press on the braid (Matiskova 2021, section 1).

    Above it force and volume do the same work. A cycle that goes below costs up to the threshold
    times the change of volume: 3 % of the work at 4.87 bar with a threshold of 0.15 bar.
    """

    pressure: float = quantity("[0, 3e5] Pa", "gauge pressure lost to the tube", 0.0)


class EndShape(ParameterGroup, group="end_shape"):
    """Share of the active force that the ends take in the end, and where it sets in."""

    loss: float = quantity(
        "[0, 1]", "share of the active force lost far beyond the onset; half of it 0.1 beyond", 0.0
    )
    onset: float = quantity("[-0.1, 0.5]", "contraction from which force is lost", 0.0)


def effective_pressure(pressure: float, threshold: float) -> float:
    """Gauge pressure that reaches the braid, max(p - p_0, 0) [Pa]; NaN stays NaN."""
    if pressure < threshold:
        return 0.0
    return pressure - threshold


def force_left(ends: EndShape, contraction: float) -> tuple[float, float]:
    """Share in [0, 1] of the active force that the ends leave, and its slope; NaN stays NaN."""
    if contraction <= ends.onset:
        return 1.0, 0.0
    x = contraction - ends.onset
    room = x * x + _HALF * _HALF
    return 1.0 - ends.loss * (x * x) / room, -2.0 * ends.loss * x * _HALF * _HALF / (room * room)


def taut(force: float) -> float:
    """Limit a signed force to tension, max(force, 0) [N]: a slack muscle carries nothing.

    Its volume goes on following the tendon, so a cycle that goes through slack costs or yields, by
    its sense, the energy of the rubber that is not carried: 6 % of the work of a MAS-20 muscle over
    +-3.16 % contraction at 4.87 bar.
    """
    if force <= 0.0:  # a comparison, so that NaN stays NaN and is noticed
        return 0.0
    return force
