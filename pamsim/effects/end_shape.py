"""Force lost to the tapered ends of a contracted muscle."""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    name="end_shape",
    family="muscle_force",
    layer="muscle",
    missing="force lost to the tapered ends of a contracted muscle",
    parameters=(
        EffectParameter(name="end_shape.loss", typical=0.5, low=0.0, high=1.0, natural_ends=True),
        EffectParameter(
            name="end_shape.onset", typical=0.01, low=0.0, high=0.2, shape=True, starts=(0.0, 0.03)
        ),
    ),
    signature="force too high at large contraction only",
    look_alikes=("passive_stiffness", "threshold_pressure"),
    separating="isometric force at several lengths from nominal to fully contracted",
    probes=(0.3, 1.0, 1.9),
)
