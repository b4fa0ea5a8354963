"""Friction at the joint in proportion to its speed."""

from __future__ import annotations

from pamsim.effects.effect import JOINT, Effect, EffectParameter

EFFECT = Effect(
    name="viscous_friction",
    family="joint_friction",
    layer="joint",
    missing="friction at the joint in proportion to its speed",
    parameters=(
        EffectParameter(
            name=f"joint.{JOINT}.damping",
            typical=1.5,
            low=0.2,
            high=5.0,
            neutral=None,
            relative=True,
        ),
    ),
    signature="transients too fast or too slow, loops wider at higher rates, none at rest",
    look_alikes=("line_lag", "valve_flow", "added_inertia"),
    separating="let the arm swing freely from one pressure and watch how fast the swing dies",
)
