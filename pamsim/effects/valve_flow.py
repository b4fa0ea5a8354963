"""Another flow through the valves."""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    name="valve_flow",
    family="valve",
    layer="pneumatic",
    missing="another flow through the valves",
    parameters=(
        EffectParameter(
            name="valve.conductance_fill",
            typical=0.8,
            low=0.2,
            high=5.0,
            neutral=None,
            relative=True,
        ),
        EffectParameter(
            name="valve.conductance_exhaust",
            typical=0.8,
            low=0.2,
            high=5.0,
            neutral=None,
            relative=True,
        ),
    ),
    signature="pressure ramps too steep or too flat while a valve is open, right at rest",
    look_alikes=("supply_sag", "line_lag", "thermal_relaxation"),
    separating="fill from empty and vent from full with a valve wide open",
)
