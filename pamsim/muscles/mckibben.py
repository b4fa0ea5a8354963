"""The ideal McKibben force: virtual work of the braid and nothing else (Sarosi, equation (1))."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from pamsim.core.parameters import ParameterGroup, parameter
from pamsim.muscles.braid import volume_curvature, volume_slope


@dataclass(frozen=True, kw_only=True)
class IdealMcKibben(ParameterGroup):
    """The ideal law has the braid for its parameters; only its overall scale is free."""

    group: ClassVar[str] = "force"
    law: ClassVar[str] = "ideal_mckibben"
    scale: float = parameter(
        unit="1", low=0.0, high=5.0, low_open=True, doc="factor on the force", default=1.0
    )


def ideal_force(
    pressure: float, length: float, nominal_length: float, diameter: float, fibre_angle: float
) -> float:
    """Tension F = -p dV/dl of an ideal braided muscle (Sarosi, (1); Matiskova 2021, (3)).

    Args:
        pressure: gauge pressure p [Pa].
        length: muscle length l [m].
        nominal_length: l0 [m].
        diameter: D0 [m].
        fibre_angle: alpha0 [rad].

    Returns:
        Force [N], positive when the muscle pulls; not yet limited to tension.
    """
    return -pressure * volume_slope(length, nominal_length, diameter, fibre_angle)


def ideal_force_dp(
    pressure: float, length: float, nominal_length: float, diameter: float, fibre_angle: float
) -> float:
    """Derivative dF/dp = -dV/dl [N/Pa] of `ideal_force`, whose arguments it takes."""
    return -volume_slope(length, nominal_length, diameter, fibre_angle)


def ideal_force_dkappa(
    pressure: float, length: float, nominal_length: float, diameter: float, fibre_angle: float
) -> float:
    """Derivative dF/dkappa = p l0 d2V/dl2 [N] of `ideal_force`, whose arguments it takes."""
    curvature = volume_curvature(length, nominal_length, diameter, fibre_angle)
    return pressure * nominal_length * curvature


def ideal_pressure(
    force: float, length: float, nominal_length: float, diameter: float, fibre_angle: float
) -> float:
    """Pressure that gives a force: the inverse of `ideal_force`.

    Args:
        force: F [N].
        length: muscle length l [m].
        nominal_length: l0 [m].
        diameter: D0 [m].
        fibre_angle: alpha0 [rad].

    Returns:
        Gauge pressure p [Pa], negative where the muscle cannot pull; NaN at the largest
        contraction, where it pulls at no pressure.
    """
    slope = volume_slope(length, nominal_length, diameter, fibre_angle)
    if slope == 0.0:
        return math.nan
    return -force / slope
