"""Force per pressure that falls with contraction at another rate than the force law's."""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    name="force_slope",
    family="pressure_force",
    layer="muscle",
    missing="another fall of the force with contraction than the force law's",
    parameters=(EffectParameter(name="force.d", typical=2e-3, low=-3e-2, high=3e-2, neutral=None),),
    signature="the angle off by more as the common pressure rises, at all angles alike",
    look_alikes=("stretch_weakening", "braid_extensibility"),
    separating="isometric force at a few pressures, from stretched to contracted",
)
