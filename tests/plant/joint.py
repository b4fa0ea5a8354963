"""Torques on the joint, in equations of their own.

Dry friction has two forms. Bristles deflect before they slip and are a state. The friction of
`dry_level` is a set: at standstill it takes any torque up to its level, and the joint truly sticks;
`tests.plant.integrate` finds the instants at which it sticks and breaks loose.
"""

from __future__ import annotations

import math

from tests.plant.records import Record


def dry_level(j: Record, speed: float, carried: float) -> float:
    """Torque of the friction that sticks [N m], at a speed [rad/s] and a sum of tensions [N]."""
    level = j.dry + j.carried * carried
    if j.static > 0.0:
        level += j.static * math.exp(-((speed / j.static_speed) ** 2))
    return level


def sticks(j: Record) -> bool:
    """Whether the joint has friction that sticks."""
    return j.dry > 0.0 or j.static > 0.0 or j.carried > 0.0


def bristle_rate(j: Record, deflection: float, speed: float) -> float:
    """Rate of the bristles' deflection [rad/s] (Dahl; LuGre where the level falls with speed)."""
    if speed == 0.0:
        return 0.0
    level = 1.0
    if j.bristle_static > 0.0:
        level += j.bristle_static / j.bristle * math.exp(-((speed / j.bristle_speed) ** 2))
    left = 1.0 - math.copysign(deflection, deflection * speed) / (j.bristle_slip * level)
    return speed * math.copysign(abs(left) ** j.bristle_power, left)


def free_torque(j: Record, angle: float, speed: float, deflection: float) -> float:
    """Torque of all but muscles and friction that sticks [N m], at a deflection of bristles."""
    total = j.weight_cos * math.cos(angle) + j.weight_sin * math.sin(angle) + j.torque
    total -= j.damping * speed + j.stiffness * (angle - j.spring_at)
    if j.bristle > 0.0:
        total -= j.bristle * deflection / j.bristle_slip
        total -= j.bristle_damping * bristle_rate(j, deflection, speed)
    if j.smooth_dry > 0.0:
        total -= j.smooth_dry * math.tanh(speed / j.smooth_speed)
    if j.drag != 0.0:
        total -= j.drag * speed * abs(speed) ** (j.drag_power - 1.0)
    if j.ripple != 0.0:
        total += j.ripple * math.sin(j.ripple_periods * angle + j.ripple_phase)
    if j.detent != 0.0:
        away = (angle - j.detent_at) / j.detent_width
        total -= j.detent * away * math.exp(0.5 * (1.0 - away * away))
    if j.stop_stiffness > 0.0 and angle > j.stop_at:
        total -= j.stop_stiffness * (angle - j.stop_at)
    if j.patch > 0.0:
        away = (angle - j.patch_at) / j.patch_width
        total -= j.patch * math.exp(-0.5 * away * away) * math.tanh(speed / j.patch_speed)
    total -= j.cube * angle**3
    return total
