"""Restoring force of the compressed air about a working point (Nguyen 2024, equations (3) and (5)).

A muscle filled to P1 and held at length l1 pulls with F_con = -(P1 - Patm) dV/dl at l1 (virtual
work). Pulled to another length l, at which the pressure is P, its air pulls back with the rest:

    F_air = -(P - Patm) dV/dl + (P1 - Patm) dV/dl at l1.

The print of (3) and (5) has lost the signs; these are the ones virtual work requires (dV/dl < 0
while the muscle can pull) and the ones that make F_air zero at the working point, as a restoring
force must be. F_con + F_air is therefore the ideal law -p dV/dl, and only the constant F_con, the
load carried at the working point, is missing from F_air. Patm drops out: with gauge pressures it
appears nowhere. How P follows from l, P V^k = const (2), belongs to the chamber, not to the law.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from pamsim.core.parameters import ParameterGroup, parameter
from pamsim.physics.braid import volume_gained, volume_slope


@dataclass(frozen=True, kw_only=True)
class ElasticEnergy(ParameterGroup):
    """The working point from which the restoring force counts."""

    group: ClassVar[str] = "force"
    law: ClassVar[str] = "elastic_energy"
    scale: float = parameter(
        unit="1", low=0.0, high=5.0, low_open=True, doc="factor on the force", default=1.0
    )
    working_pressure: float = parameter(
        unit="Pa", low=0.0, high=2e6, doc="gauge pressure P1 - Patm at the working point"
    )
    working_contraction: float = parameter(
        unit="1", low=-0.3, high=0.5, doc="contraction 1 - l1/l0 at the working point"
    )


def contractive_force(
    pressure: float, contraction: float, diameter: float, fibre_angle: float
) -> float:
    """Pull F_con of the filled muscle (Nguyen 2024, equation (3)).

    Args:
        pressure: gauge pressure P1 - Patm [Pa].
        contraction: 1 - l1/l0 [-].
        diameter: D0 [m].
        fibre_angle: alpha0 [rad].

    Returns:
        F_con [N], positive when the muscle pulls.
    """
    # dV/dl depends on l/l0 alone, so lengths are taken in units of l0.
    return -pressure * volume_slope(1.0 - contraction, 1.0, diameter, fibre_angle)


def elastic_energy_force(
    pressure: float,
    contraction: float,
    working_pressure: float,
    working_contraction: float,
    diameter: float,
    fibre_angle: float,
) -> float:
    """Restoring force F_air of the air (Nguyen 2024, equation (5)).

    The arguments are gauge pressure P - Patm [Pa] and contraction kappa = 1 - l/l0 [-] at the
    present length, the fields of `ElasticEnergy` after its scale, and diameter D0 [m] and fibre
    angle alpha0 [rad] of `Braid`.

    Returns:
        F_air [N]: what the muscle pulls more than at the working point, negative if less.
    """
    at_work = contractive_force(working_pressure, working_contraction, diameter, fibre_angle)
    return contractive_force(pressure, contraction, diameter, fibre_angle) - at_work


def elastic_energy_volume(
    pressure: float,
    contraction: float,
    working_pressure: float,
    working_contraction: float,
    diameter: float,
    fibre_angle: float,
) -> float:
    """Volume that belongs to `elastic_energy_force`, whose arguments it takes: the braid's own.

    Returns:
        Volume gained since nominal length, per nominal length [m^2]. Pressure and working point
        have no influence.
    """
    return volume_gained(contraction, diameter, fibre_angle)


def elastic_energy_work(
    contraction: float,
    working_pressure: float,
    working_contraction: float,
    diameter: float,
    fibre_angle: float,
) -> float:
    """Work of the constant part from nominal length on, per nominal length [N].

    The arguments are those of `elastic_energy_force`.
    """
    held = contractive_force(working_pressure, working_contraction, diameter, fibre_angle)
    return -held * contraction
