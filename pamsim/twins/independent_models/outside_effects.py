"""Effects that the library does not hold.

Most resemble no effect of the library, so that any name would be wrong. For those that resemble
some of its effects (``resembles``), such a name is the best that data can give.
"""

from __future__ import annotations

import math

import numpy as np

from pamsim.actuator.layout import slot
from pamsim.comparison.effects_on_rig import rig_name
from pamsim.core.errors import InputError
from pamsim.effects.effect import SECOND_MUSCLE
from pamsim.engine.rig import Rig
from pamsim.engine.rig_parameter import rig_parameter
from pamsim.pneumatics.air import GAS_CONSTANT
from pamsim.twins.independent_models.independent_model import IndependentModel, Law
from pamsim.twins.independent_models.plant import Plant, RunContext

_SCALE = slot("force.0")
_TEMPERATURE = slot("chamber.temperature")
_ATMOSPHERE = slot("chamber.atmosphere")

_RIPPLE, _TEETH = 0.15, 16
"""Amplitude [N m] and periods per turn of the sprocket's ripple, from the engaging pins."""

_AGEING, _AGEING_TIME = 0.03, 4.0
"""Final share of the force lost, and time constant [s] of the loss."""

_STUCK = 0.3
"""Largest opening of a stuck valve."""

_SMOOTH_TORQUE, _FEATURES = 0.15, 8
"""RMS [N m] of the smooth torque, and its number of waves."""

_SPREAD = 0.6
"""Wave numbers of the smooth torque, in units of each signal's usual range."""

_DRAG = 0.15
"""Quadratic drag [N m s^2/rad^2]."""

_COOLING = 25.0
"""Difference of the air's temperature [K]."""

_OFFSET = 2e-4
"""Difference of a muscle's mounted length [m]."""

_CABLES = 0.2
"""Stiffness of hoses and cables that bend with the joint [N m/rad]."""

_RUBBING, _CREEPING = 1e-4, 0.02
"""Bearing friction torque per tension [m], and speed below which it vanishes [rad/s]."""

_CROSS_LEAK = 1e-11
"""Flow from muscle to muscle per difference of pressure, as a volume at ambient [m^3/(s Pa)]."""


def _ripple(size: float, context: RunContext) -> Law:
    rng = np.random.default_rng([context.seed, 11])
    phase = float(rng.uniform(0.0, 2.0 * math.pi))

    def law(plant: Plant) -> None:
        plant.torque += size * _RIPPLE * math.sin(_TEETH * plant.angle + phase)

    return law


def _ageing(size: float, context: RunContext) -> Law:
    def law(plant: Plant) -> None:
        lost = -size * _AGEING * math.expm1(-max(plant.time, 0.0) / _AGEING_TIME)
        for i in plant.muscles:
            plant.user[i, _SCALE] = plant.rows[i][_SCALE] * (1.0 - lost)

    return law


def _stuck(size: float, context: RunContext) -> Law:
    rng = np.random.default_rng([context.seed, 12])
    muscle, fills = int(rng.integers(len(context.rig.muscles))), bool(rng.integers(2))
    furthest, begin = _STUCK**size, 0.5 * context.experiment.duration

    def law(plant: Plant) -> None:
        opening = plant.opening(muscle)
        if plant.time >= begin:
            opening = min(opening, furthest) if fills else max(opening, -furthest)
        plant.set_opening(muscle, opening)

    return law


class SmoothTorque:
    """A random smooth function of angle, speed and both pressures, as a torque.

    Args:
        rms: over many functions [N m].
        rng: that draws it.
    """

    def __init__(self, rms: float, rng: np.random.Generator) -> None:
        waves = rng.normal(0.0, _SPREAD, (_FEATURES, 4))
        phases = rng.uniform(0.0, 2.0 * math.pi, _FEATURES)
        self._waves = [(*w, float(p)) for w, p in zip(waves.tolist(), phases, strict=True)]
        self._gain = rms * math.sqrt(2.0 / _FEATURES)

    def torque(self, angle: float, speed: float, first: float, second: float) -> float:
        """Torque [N m] at an angle [rad], speed [rad/s] and two gauge pressures [Pa]."""
        a, b = angle / 0.3, speed / 0.5
        c, d = (first - second) / 1e5, (first + second) / 2e5
        total = 0.0
        for wa, wb, wc, wd, phase in self._waves:
            total += math.cos(wa * a + wb * b + wc * c + wd * d + phase)
        return self._gain * total

    def __call__(self, plant: Plant) -> None:
        """Turn the joint."""
        plant.torque += self.torque(plant.angle, plant.speed, plant.pressure(0), plant.pressure(1))


def _smooth(size: float, context: RunContext) -> Law:
    if len(context.rig.muscles) != 2:
        raise InputError(
            "smooth_torque is a function of two pressures; the rig does not have two muscles"
        )
    return SmoothTorque(size * _SMOOTH_TORQUE, np.random.default_rng([context.seed, 13]))


def _drag(size: float, context: RunContext) -> Law:
    def law(plant: Plant) -> None:
        plant.torque -= size * _DRAG * plant.speed * abs(plant.speed)

    return law


def _cables(size: float, context: RunContext) -> Law:
    def law(plant: Plant) -> None:
        plant.torque -= size * _CABLES * plant.angle

    return law


def _rubbing(size: float, context: RunContext) -> Law:
    def law(plant: Plant) -> None:
        carried = sum(plant.tension(i) for i in plant.muscles)
        plant.torque -= size * _RUBBING * carried * math.tanh(plant.speed / _CREEPING)

    return law


def _cross_leak(size: float, context: RunContext) -> Law:
    if len(context.rig.muscles) != 2:
        raise InputError("cross_leak is between two muscles; the rig does not have two muscles")

    def law(plant: Plant) -> None:
        temperature = plant.rows[0][_TEMPERATURE]
        over = plant.pressure_abs(0) - plant.pressure_abs(1)
        flow = size * _CROSS_LEAK * over * plant.rows[0][_ATMOSPHERE] / (GAS_CONSTANT * temperature)
        plant.add_air(0, -flow)
        plant.add_air(1, flow)

    return law


def _cooling(rig: Rig, size: float) -> dict[str, float]:
    name = "chamber.temperature"
    return {name: rig_parameter(rig, name).value - size * _COOLING}


def _offset(rig: Rig, size: float) -> dict[str, float]:
    name = rig_name(rig, f"{SECOND_MUSCLE}:mounting.length_at_zero")
    return {name: rig_parameter(rig, name).value + size * _OFFSET}


MODELS = (
    IndependentModel(
        name="stuck_valve",
        formulation="one valve opens to 0.3 at most in the second half of each trial",
        law=_stuck,
    ),
    IndependentModel(
        name="ageing_drift",
        formulation="both muscles lose force within each trial, up to 3 %",
        law=_ageing,
        signed=True,
    ),
    IndependentModel(
        name="sprocket_ripple",
        formulation="a torque of 16 periods per turn",
        law=_ripple,
        signed=True,
    ),
    IndependentModel(
        name="smooth_torque",
        formulation="a random smooth function of angle, speed and both pressures",
        law=_smooth,
        signed=True,
    ),
    IndependentModel(
        name="quadratic_drag",
        formulation="a torque against the motion, quadratic in speed",
        law=_drag,
    ),
    IndependentModel(
        name="cold_air",
        formulation="air 25 K colder than the model's",
        parameters=_cooling,
        resembles=("valve_flow",),
        signed=True,
    ),
    IndependentModel(
        name="mounting_offset",
        formulation="second muscle mounted 0.2 mm longer",
        parameters=_offset,
        resembles=("angle_bias", "muscle_mismatch", "load_torque"),
        signed=True,
    ),
    IndependentModel(
        name="cable_spring",
        formulation="hoses and cables that bend with the joint, 0.2 N m/rad",
        law=_cables,
        resembles=("passive_stiffness", "angle_scale"),
        signed=True,
    ),
    IndependentModel(
        name="bearing_friction",
        formulation="dry friction proportional to the tension on the bearing",
        law=_rubbing,
        resembles=("coulomb_friction", "muscle_hysteresis"),
    ),
    IndependentModel(
        name="cross_leak",
        formulation="a laminar leak from one muscle to the other",
        law=_cross_leak,
        resembles=("air_leak",),
    ),
)
"""Effects from outside the library."""
