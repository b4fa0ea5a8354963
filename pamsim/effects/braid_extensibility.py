"""Fibres of the braid that give under pressure."""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    name="braid_extensibility",
    family="pressure_force",
    layer="muscle",
    missing="fibres that give, so that pressure lengthens the braid",
    parameters=(
        EffectParameter(name="braid.extensibility", typical=2e-8, low=0.0, high=4e-7, neutral=None),
    ),
    signature="the angle goes too far or not far enough where both pressures are high",
    look_alikes=("stretch_weakening", "force_slope"),
    separating="isometric force of a stretched muscle at several pressures: fibres that give shift"
    " the curve along the length, a weaker pressure flattens it",
)
