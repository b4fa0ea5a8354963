"""A lag between the command and the valves."""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    name="line_lag",
    family="delay",
    layer="command",
    missing="a lag between the command and the valves",
    parameters=(EffectParameter(name="valve.line_lag", typical=0.02, low=0.0, high=0.5),),
    signature="edges of the command rounded off",
    look_alikes=("valve_delay", "pressure_lag", "valve_flow"),
    separating="sharp steps at a high sampling rate: a lag rises at once",
)
