"""An offset of the pressure sensors."""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    name="pressure_bias",
    family="pressure_deficit",
    layer="measurement",
    missing="an offset of the pressure sensors",
    parameters=(EffectParameter(name="sensor.pressure_bias", typical=3e3, low=-5e4, high=5e4),),
    signature="pressures off by the same amount everywhere",
    look_alikes=("air_leak", "pressure_scale"),
    separating="vent to the atmosphere and read the sensors",
)
