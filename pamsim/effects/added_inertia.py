"""Inertia on the joint."""

from __future__ import annotations

from pamsim.effects.effect import JOINT, Effect, EffectParameter

EFFECT = Effect(
    name="added_inertia",
    family="inertia",
    layer="joint",
    missing="inertia on the joint",
    parameters=(
        EffectParameter(
            name=f"joint.{JOINT}.armature", typical=0.01, low=0.0, high=0.5, neutral=None
        ),
    ),
    signature="swings slower and larger after fast steps, nothing in slow motion",
    look_alikes=("viscous_friction",),
    separating="small loaded steps at low stiffness: the frequency of the swing tells",
)
