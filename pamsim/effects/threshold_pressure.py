"""Pressure lost in the tube before the braid is reached."""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    name="threshold_pressure",
    family="muscle_force",
    layer="muscle",
    missing="pressure lost in the tube before the braid is reached",
    parameters=(EffectParameter(name="threshold.pressure", typical=1.5e4, low=0.0, high=1.5e5),),
    signature="force too high below about one bar, right above",
    look_alikes=("chain_compliance", "passive_stiffness", "pressure_bias"),
    separating="inflate from zero at fixed length, with a force sensor",
)
