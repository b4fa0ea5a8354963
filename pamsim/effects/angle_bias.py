"""An offset of the angle sensor."""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    name="angle_bias",
    family="offset",
    layer="measurement",
    missing="an offset of the angle sensor",
    parameters=(EffectParameter(name="sensor.angle_bias", typical=0.01, low=-0.2, high=0.2),),
    signature="the angle off by the same amount everywhere, nothing else",
    look_alikes=("load_torque", "muscle_mismatch"),
    separating="read the angle at a mechanical stop",
)
