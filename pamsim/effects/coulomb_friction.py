"""Dry friction at the joint, the same at every speed."""

from __future__ import annotations

from pamsim.effects.effect import JOINT, Effect, EffectParameter

EFFECT = Effect(
    name="coulomb_friction",
    family="joint_friction",
    layer="joint",
    missing="dry friction at the joint, the same at every speed",
    parameters=(
        EffectParameter(name=f"joint.{JOINT}.frictionloss", typical=0.3, low=0.0, high=5.0),
    ),
    signature="torque jumps where the motion turns; loops as wide at every rate, amplitude and"
    " pressure",
    look_alikes=("stribeck_friction", "muscle_hysteresis", "chain_backlash"),
    separating="equal loops at two common pressures: dry friction leaves them alike, the muscle's"
    " hysteresis grows",
    probes=(0.1, 0.5, 2.0),
)
