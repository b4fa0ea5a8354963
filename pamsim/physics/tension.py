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

    Above it, without a width, force and volume do the same work. A cycle that goes below costs up
    to the threshold times the change of volume: 3 % of the work at 4.87 bar with a threshold of
    0.15 bar. A tube that touches the braid here and there before loses the pressure gradually, over
    a width.
    """

    pressure: float = quantity("[0, 3e5] Pa", "gauge pressure lost to the tube in the end", 0.0)
    width: float = quantity("[0, 1e6] Pa", "pressure at which half of that is lost; 0 at once", 0.0)


class EndShape(ParameterGroup, group="end_shape"):
    """Active force that a muscle loses to its ends: the share, and from which contraction on."""

    loss: float = quantity(
        "[0, 1]", "share of the active force lost far beyond the onset; half of it 0.1 beyond", 0.0
    )
    onset: float = quantity("[-0.1, 0.5]", "contraction from which force is lost", 0.0)


def effective_pressure(pressure: float, threshold: float, width: float = 0.0) -> float:
    """Gauge pressure that reaches the braid [Pa], at a gauge pressure p [Pa]; NaN stays NaN.

    max(p - p_0, 0) of a threshold p_0 [Pa], or max(p - p_0 p / (p + w), 0) over a width w [Pa].
    """
    lost = threshold
    if width > 0.0 and pressure > 0.0:
        lost = threshold * pressure / (pressure + width)
    if pressure < lost:
        return 0.0
    return pressure - lost


def pressure_reaching(pressure: float, threshold: float, width: float = 0.0) -> float:
    """Slope of `effective_pressure` by pressure [-]; the same arguments."""
    if not effective_pressure(pressure, threshold, width) > 0.0:
        return 0.0
    room = pressure + width
    return 1.0 - threshold * width / (room * room)


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
