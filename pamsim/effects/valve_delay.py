"""A delay before the valves act."""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    name="valve_delay",
    family="delay",
    layer="command",
    missing="a delay before the valves act",
    parameters=(EffectParameter(name="valve.delay", typical=0.01, low=0.0, high=0.1),),
    signature="everything late by the same time; phase error in proportion to frequency",
    look_alikes=("line_lag", "pressure_lag"),
    separating="sharp steps at a high sampling rate: a delay stays flat before it rises",
)
