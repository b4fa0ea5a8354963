"""A wrong scale of the angle sensor."""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    name="angle_scale",
    family="angle_scale",
    layer="measurement",
    missing="a wrong scale of the angle sensor",
    parameters=(
        EffectParameter(name="sensor.angle_scale", typical=0.03, low=0.7, high=1.4, neutral=1.0),
    ),
    signature="the angle off in proportion to itself, nothing else",
    look_alikes=("thermal_relaxation", "passive_stiffness"),
    separating="read the angle at two known positions",
)
