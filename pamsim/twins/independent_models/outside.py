"""Truths that the library of effects does not hold.

Most lie outside the span of its effects, so that no name is right. Those with a ``span`` do what
some of its effects do: there, a name of the library is the best that data can give.
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
from pamsim.twins.independent_models.independent_model import Law, Truth
from pamsim.twins.independent_models.plant import Occasion, Plant

_SCALE = slot("force.0")
_TEMPERATURE = slot("chamber.temperature")
_ATMOSPHERE = slot("chamber.atmosphere")

_RIPPLE, _TEETH = 0.15, 16
"""Amplitude [N m] and periods per turn of the sprocket's ripple: pins come in and go out."""

_AGEING, _AGEING_TIME = 0.03, 4.0
"""Share of the force lost in the end, and time constant [s] of the loss."""

_STUCK = 0.3
"""Opening beyond which a stuck valve does not go."""

_ROUGH, _FEATURES = 0.15, 8
"""RMS [N m] of the smooth torque, and number of waves in it."""

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
"""Friction of a bearing per tension that it carries [m], and speed below which it fades [rad/s]."""

_CROSS_LEAK = 1e-11
"""Flow from muscle to muscle per difference of pressure, as a volume at ambient [m^3/(s Pa)]."""


def _ripple(size: float, occasion: Occasion) -> Law:
    rng = np.random.default_rng([occasion.seed, 11])
    phase = float(rng.uniform(0.0, 2.0 * math.pi))

    def law(plant: Plant) -> None:
        plant.torque += size * _RIPPLE * math.sin(_TEETH * plant.angle + phase)

    return law


def _ageing(size: float, occasion: Occasion) -> Law:
    def law(plant: Plant) -> None:
        lost = -size * _AGEING * math.expm1(-max(plant.time, 0.0) / _AGEING_TIME)
        for i in plant.muscles:
            plant.user[i, _SCALE] = plant.rows[i][_SCALE] * (1.0 - lost)

    return law


def _stuck(size: float, occasion: Occasion) -> Law:
    rng = np.random.default_rng([occasion.seed, 12])
    muscle, fills = int(rng.integers(len(occasion.rig.muscles))), bool(rng.integers(2))
    furthest, begin = _STUCK**size, 0.5 * occasion.experiment.duration

    def law(plant: Plant) -> None:
        opening = plant.opening(muscle)
        if plant.time >= begin:
            opening = min(opening, furthest) if fills else max(opening, -furthest)
        plant.open(muscle, opening)

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


def _smooth(size: float, occasion: Occasion) -> Law:
    if len(occasion.rig.muscles) != 2:
        raise InputError("smooth_torque is a function of two pressures; the rig has other muscles")
    return SmoothTorque(size * _ROUGH, np.random.default_rng([occasion.seed, 13]))


def _drag(size: float, occasion: Occasion) -> Law:
    def law(plant: Plant) -> None:
        plant.torque -= size * _DRAG * plant.speed * abs(plant.speed)

    return law


def _cables(size: float, occasion: Occasion) -> Law:
    def law(plant: Plant) -> None:
        plant.torque -= size * _CABLES * plant.angle

    return law


def _rubbing(size: float, occasion: Occasion) -> Law:
    def law(plant: Plant) -> None:
        carried = sum(plant.tension(i) for i in plant.muscles)
        plant.torque -= size * _RUBBING * carried * math.tanh(plant.speed / _CREEPING)

    return law


def _cross_leak(size: float, occasion: Occasion) -> Law:
    if len(occasion.rig.muscles) != 2:
        raise InputError("cross_leak is between two muscles; the rig has other muscles")

    def law(plant: Plant) -> None:
        temperature = plant.rows[0][_TEMPERATURE]
        over = plant.pressure_abs(0) - plant.pressure_abs(1)
        flow = size * _CROSS_LEAK * over * plant.rows[0][_ATMOSPHERE] / (GAS_CONSTANT * temperature)
        plant.blow(0, -flow)
        plant.blow(1, flow)

    return law


def _cooling(rig: Rig, size: float) -> dict[str, float]:
    name = "chamber.temperature"
    return {name: rig_parameter(rig, name).value - size * _COOLING}


def _offset(rig: Rig, size: float) -> dict[str, float]:
    name = rig_name(rig, f"{SECOND_MUSCLE}:mounting.length_at_zero")
    return {name: rig_parameter(rig, name).value + size * _OFFSET}


TRUTHS = (
    Truth(
        name="stuck_valve",
        formulation="one of the valves opens to 0.3 at most from half of each trial on",
        law=_stuck,
    ),
    Truth(
        name="ageing_drift",
        formulation="both muscles lose force within each trial, up to 3 %",
        law=_ageing,
        signed=True,
    ),
    Truth(
        name="sprocket_ripple",
        formulation="a torque of 16 periods per turn",
        law=_ripple,
        signed=True,
    ),
    Truth(
        name="smooth_torque",
        formulation="a random smooth function of angle, speed and both pressures",
        law=_smooth,
        signed=True,
    ),
    Truth(
        name="quadratic_drag",
        formulation="a torque against the motion, quadratic in speed",
        law=_drag,
    ),
    Truth(
        name="cold_air",
        formulation="air 25 K colder than the model's",
        parameters=_cooling,
        span=("valve_flow",),
        signed=True,
    ),
    Truth(
        name="mounting_offset",
        formulation="muscle 2 mounted 0.2 mm longer",
        parameters=_offset,
        span=("angle_bias", "muscle_mismatch", "load_torque"),
        signed=True,
    ),
    Truth(
        name="cable_spring",
        formulation="hoses and cables that bend with the joint, 0.2 N m/rad",
        law=_cables,
        span=("passive_stiffness", "angle_scale"),
        signed=True,
    ),
    Truth(
        name="bearing_friction",
        formulation="dry friction in proportion to the tension that the bearing carries",
        law=_rubbing,
        span=("coulomb_friction", "muscle_hysteresis"),
    ),
    Truth(
        name="cross_leak",
        formulation="a laminar leak from one muscle to the other",
        law=_cross_leak,
        span=("air_leak",),
    ),
)
"""Truths from outside the library."""
