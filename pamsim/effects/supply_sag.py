"""A supply whose pressure falls with the flow drawn from it."""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    name="supply_sag",
    family="pressure_deficit",
    layer="pneumatic",
    missing="a supply whose pressure falls with the flow drawn from it",
    parameters=(EffectParameter(name="valve.supply_resistance", typical=2e8, low=0.0, high=5e9),),
    signature="filling slower than venting, most when the flow is large",
    look_alikes=("valve_flow", "air_leak"),
    separating="a gauge on the supply while a muscle is filled from empty",
    probes=(0.1, 0.5, 2.0),
)
