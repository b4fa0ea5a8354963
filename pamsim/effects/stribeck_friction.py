"""Friction at the joint that is higher at low speed."""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    name="stribeck_friction",
    family="joint_friction",
    layer="joint",
    missing="friction at the joint that is higher at low speed",
    parameters=(
        EffectParameter(name="friction.stribeck_force", typical=10.0, low=0.0, high=150.0),
        EffectParameter(
            name="friction.stribeck_velocity",
            typical=2e-3,
            low=2e-4,
            high=2e-2,
            shape=True,
            starts=(1e-3, 5e-3),
        ),
    ),
    signature="more friction when the arm creeps than when it runs; sticking before reversals",
    look_alikes=("coulomb_friction",),
    separating="a triangle so slow that the arm turns at less than 0.05 rad/s",
    probes=(0.1, 0.5, 2.0),
)
