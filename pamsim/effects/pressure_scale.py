"""A wrong scale of the pressure sensors."""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    name="pressure_scale",
    family="pressure_deficit",
    layer="measurement",
    missing="a wrong scale of the pressure sensors",
    parameters=(
        EffectParameter(name="sensor.pressure_scale", typical=0.02, low=0.7, high=1.4, neutral=1.0),
    ),
    signature="pressures off in proportion to themselves",
    look_alikes=("air_leak", "pressure_bias", "supply_sag"),
    separating="compare with a reference gauge at two pressures",
)
