"""A lag of the angle sensor."""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    name="angle_lag",
    family="delay",
    layer="measurement",
    missing="a lag of the angle sensor",
    parameters=(EffectParameter(name="sensor.angle_lag", typical=0.01, low=0.0, high=0.3),),
    signature="the angle off in proportion to its rate, the pressures right",
    look_alikes=("viscous_friction", "line_lag"),
    separating="tap the arm and compare with a second sensor",
)
