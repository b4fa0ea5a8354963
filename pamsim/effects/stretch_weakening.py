"""Pressure that does less on a stretched muscle than a law of contracted ones says."""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    name="stretch_weakening",
    family="pressure_force",
    layer="muscle",
    missing="pressure that does less on a stretched muscle than the force law says",
    parameters=(
        EffectParameter(name="force.a", typical=-1e-4, low=-2e-3, high=2e-3, neutral=None),
    ),
    signature="the angle goes too far or not far enough where both pressures are high",
    look_alikes=("braid_extensibility", "force_slope"),
    separating="isometric force of a stretched muscle at several pressures: fibres that give shift"
    " the curve along the length, a weaker pressure flattens it",
)
