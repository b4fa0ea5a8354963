"""The ideal McKibben force: virtual work of the braid and nothing else (Sarosi, equation (1))."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from pamsim.core.parameters import ParameterGroup, parameter
from pamsim.physics.braid import volume_gained, volume_slope


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


def ideal_tension(
    pressure: float, contraction: float, nominal_length: float, diameter: float, fibre_angle: float
) -> float:
    """`ideal_force` [N] at a contraction kappa = 1 - l/l0 [-] instead of a length."""
    length = (1.0 - contraction) * nominal_length
    return ideal_force(pressure, length, nominal_length, diameter, fibre_angle)


def ideal_volume(
    pressure: float, contraction: float, nominal_length: float, diameter: float, fibre_angle: float
) -> float:
    """Volume that belongs to `ideal_force`: the braid's own.

    The arguments are gauge pressure [Pa], which has no influence, contraction kappa = 1 - l/l0 [-]
    and the first three fields of `Braid`.

    Returns:
        Volume gained since nominal length, per nominal length [m^2].
    """
    return volume_gained(contraction, diameter, fibre_angle)
