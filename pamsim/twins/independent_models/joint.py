"""Independent models at the joint: LuGre friction, power-law drag, tilted gravity."""

from __future__ import annotations

import math

from pamsim.comparison.effects_on_rig import at_size, rig_name
from pamsim.effects.catalog import effect
from pamsim.engine.rig import Rig
from pamsim.engine.rig_parameter import rig_parameter
from pamsim.twins.independent_models.independent_model import IndependentModel, Law
from pamsim.twins.independent_models.plant import Plant, RunContext

_PRESLIDING = 2e-3
"""Deflection at which LuGre's bristles slip [rad]."""

_BRISTLE_TIME = 2e-3
"""Damping of the bristles over their stiffness [s]."""

_DAMPED_SPEED = 0.05
"""Speed above which the bristles' damping vanishes, which keeps the model passive [rad/s]."""

_CREEP_SHARE = 0.2
"""Friction at high speed as a share of that at rest, in the model of `stribeck_friction`."""

_DRAG_EXPONENT = 1.25
_DRAG_SPEED = 0.5
"""Speed at which the nonlinear viscous friction equals the linear one [rad/s]."""

_TILT_AXIS = math.radians(25.0)
"""Angle between the axis about which the rig is tilted and that of the library."""


class LuGre:
    """LuGre friction (Canudas de Wit et al. 1995) of a joint.

    Args:
        static: torque at which it breaks loose [N m].
        coulomb: torque in fast sliding [N m].
        stribeck_speed: at which it has fallen most of the way [rad/s].
    """

    def __init__(self, static: float, coulomb: float, stribeck_speed: float = 1.0) -> None:
        self._static, self._coulomb, self._speed = static, coulomb, stribeck_speed
        self._stiffness = static / _PRESLIDING
        self._deflection = 0.0

    def torque(self, speed: float, timestep: float) -> float:
        """Torque of the friction [N m] after a time step [s] at a speed [rad/s]."""
        share = speed / self._speed
        level = self._coulomb + (self._static - self._coulomb) * math.exp(-share * share)
        before = self._deflection
        # Implicit in the deflection: stable however fast the joint is.
        slip = self._stiffness * abs(speed) / level
        self._deflection = (before + timestep * speed) / (1.0 + timestep * slip)
        rate = (self._deflection - before) / timestep
        damped = math.exp(-((speed / _DAMPED_SPEED) ** 2)) * _BRISTLE_TIME
        return -self._stiffness * (self._deflection + damped * rate)

    def __call__(self, plant: Plant) -> None:
        """Brake the joint."""
        plant.torque += self.torque(plant.speed, plant.timestep)


def _coulomb(size: float, context: RunContext) -> Law:
    level = size * effect("coulomb_friction").parameters[0].typical
    return LuGre(level, level)


def _stribeck(size: float, context: RunContext) -> Law:
    force, speed = (p.typical for p in effect("stribeck_friction").parameters)
    rig = context.rig
    radii = [rig_parameter(rig, f"tendon.{t}.coef").value for t in rig.file.tendons.values()]
    static = size * force * sum(radii)
    return LuGre(static, _CREEP_SHARE * static, 1.5 * speed / radii[0])


def _viscous(size: float, context: RunContext) -> Law:
    parameter = effect("viscous_friction").parameters[0]
    damping = rig_parameter(context.rig, rig_name(context.rig, parameter.name)).value
    more = size * (parameter.typical - 1.0) * damping

    def law(plant: Plant) -> None:
        speed = plant.speed
        plant.torque -= more * speed * (abs(speed) / _DRAG_SPEED) ** (_DRAG_EXPONENT - 1.0)

    return law


def _gravity(size: float, context: RunContext) -> Law:
    tilt = size * effect("load_torque").parameters[0].typical

    def law(plant: Plant) -> None:
        plant.tilt(tilt, _TILT_AXIS)

    return law


def _inertia(rig: Rig, size: float) -> dict[str, float]:
    return at_size(rig, effect("added_inertia"), size)


MODELS = (
    IndependentModel(
        name="coulomb_friction",
        formulation="LuGre friction at the joint, equal at all sliding speeds",
        law=_coulomb,
    ),
    IndependentModel(
        name="stribeck_friction",
        formulation="LuGre friction at the joint with a Stribeck curve",
        law=_stribeck,
    ),
    IndependentModel(
        name="viscous_friction",
        formulation="joint friction proportional to speed to the power of 1.25",
        law=_viscous,
        signed=True,
    ),
    IndependentModel(
        name="load_torque",
        formulation="gravity tilted about another axis, 25 deg from the library's",
        law=_gravity,
        signed=True,
    ),
    IndependentModel(
        name="added_inertia",
        formulation="as in the library, at a finer time step",
        parameters=_inertia,
        signed=True,
    ),
)
"""Independent models of the joint effects."""
