"""A leak of air from the muscles."""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    name="air_leak",
    family="pressure_deficit",
    layer="pneumatic",
    missing="a leak of air from the muscles",
    parameters=(
        EffectParameter(name="chamber.leak_conductance", typical=2e-12, low=0.0, high=1e-10),
    ),
    signature="pressure falls while the valves are shut, and lies below the set point in holds",
    look_alikes=("pressure_scale", "pressure_bias", "supply_sag"),
    separating="shut the valves at a high pressure and watch it for some seconds",
)
