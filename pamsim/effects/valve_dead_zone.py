"""A dead zone of the valves."""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    name="valve_dead_zone",
    family="valve",
    layer="pneumatic",
    missing="a dead zone of the valves",
    parameters=(EffectParameter(name="valve.dead_zone", typical=0.05, low=0.0, high=0.5),),
    signature="no response to small openings; pressure stays off the set point on both sides of it",
    look_alikes=("coulomb_friction", "valve_flow"),
    separating="a staircase of small openings from shut",
    probes=(0.1, 0.5, 2.0),
)
