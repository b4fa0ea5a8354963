"""Stiffness of a joint between two muscles with their valves shut (Matiskova 2021, equation (5)).

A shut muscle resists in two ways: its air is compressed (compressibility part) and its geometry
changes at a pressure that stays (geometric part). For the ideal law F = -p dV/dl they are
-dP/dV (dV/dl)^2 and -p d2V/dl2. Matiskova 2021 prints (5) with a plus before the second muscle's
geometric part; by symmetry both parts must have the same sign, and here they do.

Pressures p are gauge in the force, absolute in dP/dV. Hysteresis is left out: its stiffness
depends on the path.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from pamsim.physics.chosen_law import law_pushes
from pamsim.physics.record import Parameters
from pamsim.physics.static_muscle import static_force, static_volume
from pamsim.physics.tension import taut

_LENGTH_STEP = 1e-4  # of the nominal length: rounding and the stencil's h^4 error both below 1e-8
_PRESSURE_STEP = 100.0  # [Pa]; the laws are linear in pressure but for kinks


@dataclass(frozen=True, kw_only=True)
class Stiffness:
    """Stiffness and its two parts, all positive if they restore [N/m] or [N m/rad].

    Attributes:
        compressibility: from the change of pressure in the shut chamber.
        geometric: from the change of geometry at constant pressure, rubber included.
    """

    compressibility: float
    geometric: float

    @property
    def total(self) -> float:
        """Sum of both parts."""
        return self.compressibility + self.geometric


def pressure_slope(m: Parameters, tendon_length: float, pressure: float) -> float:
    """Change of pressure with length of a shut chamber [Pa/m], at a gauge pressure [Pa].

    It keeps P V^n, so dP/dl = -n P (dV/dl) / (V + n P dV/dp).
    """
    inside = static_volume(m, tendon_length, pressure)
    by_length, by_pressure = _derivatives(static_volume, m, tendon_length, pressure)
    stiffness = m.chamber.polytropic_index * (pressure + m.chamber.atmosphere)
    return -stiffness * by_length / (inside + stiffness * by_pressure)


def muscle_stiffness(m: Parameters, tendon_length: float, pressure: float) -> Stiffness:
    """Stiffness dF/dl of one shut muscle under any force law [N/m]; zero for a slack muscle.

    The derivatives of the law are finite differences, so that a new law needs no change here. At
    the kink of a pressure threshold they average both sides. The pressure is gauge [Pa].
    """
    if not law_pushes(m) and static_force(m, tendon_length, pressure) <= 0.0:
        return Stiffness(compressibility=0.0, geometric=0.0)
    by_length, by_pressure = _derivatives(static_force, m, tendon_length, pressure)
    compressibility = by_pressure * pressure_slope(m, tendon_length, pressure)
    return Stiffness(compressibility=compressibility, geometric=by_length)


def _derivatives(
    law: Callable[[Parameters, float, float], float], m: Parameters, length: float, pressure: float
) -> tuple[float, float]:
    h = _LENGTH_STEP * m.braid.nominal_length
    near = law(m, length + h, pressure) - law(m, length - h, pressure)
    far = law(m, length + 2.0 * h, pressure) - law(m, length - 2.0 * h, pressure)
    up, down = law(m, length, pressure + _PRESSURE_STEP), law(m, length, pressure - _PRESSURE_STEP)
    return (8.0 * near - far) / (12.0 * h), (up - down) / (2.0 * _PRESSURE_STEP)


def joint_stiffness(muscles: Sequence[Stiffness], radii: Sequence[float]) -> Stiffness:
    """Stiffness sum r^2 k [N m/rad] of a joint, from its muscles' [N/m] and moment arms [m]."""
    pairs = list(zip(muscles, radii, strict=True))
    return Stiffness(
        compressibility=sum(r * r * k.compressibility for k, r in pairs),
        geometric=sum(r * r * k.geometric for k, r in pairs),
    )


def antagonist_torque(
    pair: Sequence[Parameters], radius: float, angle: float, pressures: Sequence[float]
) -> float:
    """Torque r (F1 - F2) of two muscles on one sprocket [N m] (Matiskova 2021, (4)).

    Of (2,) parameters, each muscle at tendon length 0 at angle 0, the sprocket's radius [m], its
    angle beta [rad], by which muscle 1 shortens by r beta, and (2,) gauge pressures [Pa].
    """
    first = taut(static_force(pair[0], -radius * angle, pressures[0]))
    second = taut(static_force(pair[1], radius * angle, pressures[1]))
    return radius * (first - second)
