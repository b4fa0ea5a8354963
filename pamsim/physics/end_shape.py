"""Force lost to the ends of a contracted muscle.

Where the braid meets the fittings it cannot widen: a cone forms that does not pull like the
cylinder, and the more of the length is cone, the further the muscle has contracted (Tondu and Lopez
2000 lengthen the contraction by a factor for it). Here a share of the active force is lost that
sets in at a contraction without a kink and tends to a largest one:

    share = 1 - loss x^2 / (x^2 + 0.1^2),   x = kappa - onset > 0
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from pamsim.core.parameters import ParameterGroup, parameter

_HALF = 0.1
"""Contraction beyond the onset at which half of the loss is reached [-]."""


@dataclass(frozen=True, kw_only=True)
class EndShape(ParameterGroup):
    """Share of the active force that the ends take in the end, and where it sets in."""

    group: ClassVar[str] = "end_shape"
    loss: float = parameter(
        unit="1",
        low=0.0,
        high=1.0,
        doc="share of the active force lost far beyond the onset; half of it 0.1 beyond",
        default=0.0,
    )
    onset: float = parameter(
        unit="1", low=-0.1, high=0.5, doc="contraction from which force is lost", default=0.0
    )


def force_left(contraction: float, loss: float, onset: float) -> float:
    """Share of the active force that the ends leave.

    Args:
        contraction: kappa [-].
        loss: in [0, 1].
        onset: contraction from which force is lost [-].

    Returns:
        Share in [0, 1]; 1 up to the onset; NaN stays NaN.
    """
    if contraction <= onset:
        return 1.0
    beyond = (contraction - onset) * (contraction - onset)
    return 1.0 - loss * beyond / (beyond + _HALF * _HALF)


def force_left_slope(contraction: float, loss: float, onset: float) -> float:
    """Derivative of `force_left` by contraction, whose arguments it takes [-]; never positive."""
    if contraction <= onset:
        return 0.0
    beyond = contraction - onset
    room = beyond * beyond + _HALF * _HALF
    return -2.0 * loss * beyond * _HALF * _HALF / (room * room)
