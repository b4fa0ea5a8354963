"""What makes a force a tension: a muscle cannot push, and it does not pull below a threshold."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from pamsim.core.parameters import ParameterGroup, parameter


@dataclass(frozen=True, kw_only=True)
class Threshold(ParameterGroup):
    """Pressure below which the tube does not yet press on the braid (Matiskova 2021, section 1).

    Above it force and volume do the same work. A cycle that goes below costs up to the threshold
    times the change of volume: 3 % of the work at 4.87 bar with a threshold of 0.15 bar.
    """

    group: ClassVar[str] = "threshold"
    pressure: float = parameter(
        unit="Pa", low=0.0, high=3e5, doc="gauge pressure lost to the tube", default=0.0
    )


def effective_pressure(pressure: float, threshold: float) -> float:
    """Gauge pressure that reaches the braid.

    Args:
        pressure: gauge pressure p [Pa].
        threshold: p_0 [Pa].

    Returns:
        max(p - p_0, 0) [Pa]; NaN stays NaN.
    """
    if pressure < threshold:
        return 0.0
    return pressure - threshold


def taut(force: float) -> float:
    """Limit a force to tension: a slack muscle carries nothing.

    Its volume goes on following the tendon, so a cycle that goes through slack costs or yields, by
    its sense, the energy of the rubber that is not carried: 6 % of the work of a MAS-20 muscle over
    +-3.16 % contraction at 4.87 bar.

    Args:
        force: signed force [N].

    Returns:
        max(force, 0) [N]. Written as a comparison so that NaN stays NaN and is noticed.
    """
    if force <= 0.0:
        return 0.0
    return force
